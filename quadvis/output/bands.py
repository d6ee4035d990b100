"""Place the boxes of one level of a large diagram, and route the wires between them.

Boxes stand in columns by their distance from the sources; columns that are too high are split, and the row of
columns is folded into bands like the lines of a text. Between the columns lie channels, above and below the
bands corridors, at the left a margin. A wire leaves its box to the right into a channel. From there it
reaches the next column directly. It reaches any other column along a corridor and the channel before that
column, and another band through the margin. So no wire runs through a box. Wires of one output share their
way.
"""

from __future__ import annotations

import heapq
from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import TypeVar

from quadvis.output.boxes import LEAST_WIDTH, Box, Net, Point, in_bands, in_columns

TRACK, EDGE = 9.0, 14.0  # pixels between wires, and around boxes and wires
FAR = 1e9

_Key = TypeVar("_Key", bound=Hashable)


class Sheet:
    """Connected boxes with their places relative to ``x``, ``y`` and, after `route`, the nets' ways."""

    def __init__(self, boxes: Sequence[Box], nets: Sequence[Net], least: float = LEAST_WIDTH) -> None:
        self.boxes, self.nets = boxes, nets
        self.x = self.y = 0.0
        self.is_open = any(net.is_terminal for net in nets)
        self.bands = in_bands(in_columns(boxes, nets), nets, least)
        self.channels: dict[tuple[int, int], dict[Net, tuple[float, float]]] = defaultdict(dict)
        self.corridors: dict[int, dict[Net, list[tuple[int, int] | None]]] = defaultdict(dict)
        self.margin: dict[Net, tuple[float, float]] = {}
        for net in nets:
            self._use(net)
        self._set_across()
        self._set_along()

    def _use(self, net: Net) -> None:
        """Note the channels, corridors and margins that a net uses."""
        for key, box in net.targets.items():
            entry, height = (box.band, box.column), box.y + box.ports[key[1]]
            if self._is_next(net, box):
                self._use_channel(net, entry, self._start(net), height)
                continue
            out, into = _corridors(net, box)
            self._use_channel(net, entry, height, -FAR if into == box.band else FAR)
            self._use_corridor(net, into, entry)
            if net.source:
                self._leave(net, out)
            else:
                self._use_corridor(net, out, None)
            if out != into:
                low, high = self.margin.get(net, (FAR, -FAR))
                self.margin[net] = min(low, out, into), max(high, out, into)
        if net.leaves and net.source:
            self._leave(net, net.source.band + 1)

    def _leave(self, net: Net, corridor: int) -> None:
        assert net.source is not None
        channel = (net.source.band, net.source.column + 1)
        end = -FAR if corridor == net.source.band else FAR
        self._use_channel(net, channel, self._start(net), end)
        self._use_corridor(net, corridor, channel)

    def _use_channel(self, net: Net, channel: tuple[int, int], *heights: float) -> None:
        low, high = self.channels[channel].get(net, (FAR, -FAR))
        self.channels[channel][net] = min(low, *heights), max(high, *heights)

    def _use_corridor(self, net: Net, corridor: int, channel: tuple[int, int] | None) -> None:
        self.corridors[corridor].setdefault(net, []).append(channel)

    @staticmethod
    def _is_next(net: Net, box: Box) -> bool:
        source = net.source
        return source is not None and (source.band, source.column + 1) == (box.band, box.column)

    @staticmethod
    def _start(net: Net) -> float:
        assert net.source is not None
        return net.source.y + net.source.ports[net.port]

    def _set_across(self) -> None:
        """Give channels, columns and the margin their places from left to right."""
        self.lanes: dict[tuple[Net, tuple[int, int]], float] = {}
        tracks, count = _tracks(self.margin)
        self.sides = {net: EDGE + TRACK * track for net, track in tracks.items()}
        begin = EDGE + TRACK * count + (EDGE if count else 0.0)
        self.width = 0.0
        for band, columns in enumerate(self.bands):
            x = begin
            for column in range(len(columns) + 1):
                tracks, count = _tracks(self.channels.get((band, column), {}))
                first = x + (EDGE if column else 0.0)
                self.lanes.update({(net, (band, column)): first + TRACK * at for net, at in tracks.items()})
                x = first + TRACK * count + (EDGE if count or column else 0.0)
                if column < len(columns):
                    x += max((reach for box in columns[column] for reach in box.reach.values()), default=0.0)
                    for box in columns[column]:
                        box.x = x
                    x += max(box.width for box in columns[column])
            self.width = max(self.width, x)

    def _set_along(self) -> None:
        """Give corridors and bands their places from top to bottom."""
        self.heights: dict[tuple[Net, int], float] = {}
        y = 0.0
        self.tops = []
        for corridor in range(len(self.bands) + 1):
            spans = {net: self._span(net, corridor) for net in self.corridors.get(corridor, {})}
            tracks, count = _tracks(spans)
            y += EDGE if corridor else 0.0
            self.heights.update({(net, corridor): y + TRACK * at for net, at in tracks.items()})
            y += TRACK * count + (EDGE if count and corridor < len(self.bands) else 0.0)
            if corridor < len(self.bands):
                self.tops.append(y)
                y += max(box.y + box.height for column in self.bands[corridor] for box in column)
        self.height = y

    def _span(self, net: Net, corridor: int) -> tuple[float, float]:
        """Return the two ends of a net's way in a corridor."""
        ends = [self.lanes[net, channel] if channel else 0.0 for channel in self.corridors[corridor][net]]
        if net in self.margin:
            ends.append(self.sides[net])
        if net.leaves and net.source and corridor == net.source.band + 1:
            ends.append(FAR)
        return min(ends), max(ends)

    def route(self, frame: float) -> None:
        """Fill in the ways of all nets, once ``x`` and ``y`` are known, for a frame of this width."""
        for box in self.boxes:
            box.x += self.x
            box.y += self.y + self.tops[box.band]
        for net in self.nets:
            for key, box in net.targets.items():
                net.ways[key] = list(self._way(net, key, box))
            if net.source and net.leaves:
                corridor = net.source.band + 1
                net.height = self.y + self.heights[net, corridor]
                net.way_out = [*self._way_out(net, corridor), (frame, net.height)]
            elif net.source is None:
                net.height = self.y + self.heights[net, _corridors(net, next(iter(net.targets.values())))[0]]

    def _way(self, net: Net, key: tuple[str, str], box: Box) -> Iterator[Point]:
        lane = self.x + self.lanes[net, (box.band, box.column)]
        end = box.y + box.ports[key[1]]
        if self._is_next(net, box):
            assert net.source is not None
            start = self._start(net)
            yield from ((net.source.x + net.source.width, start), (lane, start))
        else:
            out, into = _corridors(net, box)
            height = self.y + self.heights[net, out]
            yield from self._way_out(net, out) if net.source else iter([(0.0, height)])
            if out != into:
                side = self.x + self.sides[net]
                yield (side, height)
                height = self.y + self.heights[net, into]
                yield (side, height)
            yield (lane, height)
        yield from ((lane, end), (box.x - box.reach[key[1]], end))

    def _way_out(self, net: Net, corridor: int) -> Iterator[Point]:
        """Yield the way from a box into a corridor."""
        assert net.source is not None
        start = self._start(net)
        lane = self.x + self.lanes[net, (net.source.band, net.source.column + 1)]
        yield from ((net.source.x + net.source.width, start), (lane, start))
        yield (lane, self.y + self.heights[net, corridor])


def _corridors(net: Net, box: Box) -> tuple[int, int]:
    """Return the corridors by which a wire leaves its source (or the frame) and by which it reaches a box."""
    if net.source is None:
        first = min(target.band for target in net.targets.values())
        return first, box.band
    here, there = net.source.band, box.band
    if here == there:
        return here + 1, here + 1
    return (here + 1, there) if there > here else (here, there + 1)


def _tracks(spans: Mapping[_Key, tuple[float, float]]) -> tuple[dict[_Key, int], int]:
    """Return a track for each span, different ones for spans that meet, and the number of tracks."""
    found: dict[_Key, int] = {}
    busy: list[tuple[float, int]] = []
    free: list[int] = []
    count = 0
    for key, (low, high) in sorted(spans.items(), key=lambda entry: entry[1]):
        while busy and busy[0][0] + TRACK < low:
            heapq.heappush(free, heapq.heappop(busy)[1])
        if not free:
            heapq.heappush(free, count)
            count += 1
        found[key] = heapq.heappop(free)
        heapq.heappush(busy, (high, found[key]))
    return found, count
