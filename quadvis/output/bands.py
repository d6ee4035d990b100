"""Place the boxes of one level of a large diagram, and lead the wires between them.

Boxes stand in columns by their distance from the sources; columns that are too high are split, and the row of
columns is folded into bands like the lines of a text. Channels lie between the columns, corridors above and
below the bands, a margin at the left. A wire leaves its box to the right into a channel. The next column is
reached from there; any other one along a corridor and through the channel before it, from band to band
through the margin. So no wire runs through a box. Wires of one output share their way.
"""

from __future__ import annotations

import heapq
import math
from collections import defaultdict
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TypeVar

ASPECT = 1.6  # of a picture: its width by its height
GAP, TRACK, EDGE = 26.0, 9.0, 14.0  # pixels between boxes, between wires, and around both
LEAST_WIDTH, LEAST_HEIGHT = 1400.0, 700.0  # of a band and a column, before they are folded and split
FAR = 1e9

Point = tuple[float, float]
_Key = TypeVar("_Key", bound=Hashable)


@dataclass(eq=False)
class Box:
    """A block or a part. ``ports`` are their heights from its top, ``reach`` how far before it wires end."""

    id: str
    width: float = 0.0
    height: float = 0.0
    ports: dict[str, float] = field(default_factory=dict)
    reach: dict[str, float] = field(default_factory=dict)
    x: float = 0.0
    y: float = 0.0
    band: int = 0
    column: int = 0


@dataclass(eq=False)
class Net:
    """What one output drives on a level: ports of boxes, and the right side of the frame if it ``leaves``.

    Without a source it enters at the left side of the frame. Where it passes the frame is its ``height``.
    """

    port: str
    source: Box | None
    targets: dict[tuple[str, str], Box] = field(default_factory=dict)
    leaves: bool = False
    height: float = 0.0
    ways: dict[tuple[str, str], list[Point]] = field(default_factory=dict)
    way_out: list[Point] = field(default_factory=list)

    def reach_for(self, box: Box, port: str) -> None:
        """Drive one more port."""
        self.targets[box.id, port] = box

    @property
    def is_terminal(self) -> bool:
        """Whether it passes the frame."""
        return self.leaves or self.source is None

    @property
    def boxes(self) -> list[Box]:
        """All boxes at which it ends."""
        return [*([self.source] if self.source else []), *self.targets.values()]


class Sheet:
    """Boxes that hang together: their places from ``x``, ``y`` on, and with `route` the ways of nets."""

    def __init__(self, boxes: Sequence[Box], nets: Sequence[Net]) -> None:
        self.boxes, self.nets = boxes, nets
        self.x = self.y = 0.0
        self.is_open = any(net.is_terminal for net in nets)
        self.bands = _bands(_columns(boxes, nets), nets)
        self.channels: dict[tuple[int, int], dict[Net, tuple[float, float]]] = defaultdict(dict)
        self.corridors: dict[int, dict[Net, list[tuple[int, int] | None]]] = defaultdict(dict)
        self.margin: dict[Net, tuple[float, float]] = {}
        for net in nets:
            self._use(net)
        self._set_across()
        self._set_along()

    def _use(self, net: Net) -> None:
        """Note which channels, corridors and margins a net takes."""
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
        """Return from where to where a net takes a corridor."""
        ends = [self.lanes[net, channel] if channel else 0.0 for channel in self.corridors[corridor][net]]
        if net in self.margin:
            ends.append(self.sides[net])
        if net.leaves and net.source and corridor == net.source.band + 1:
            ends.append(FAR)
        return min(ends), max(ends)

    def route(self, frame: float) -> None:
        """Fill in the ways of all nets, once ``x`` and ``y`` are known, for a frame that is so wide."""
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
    """Return the corridors by which a wire leaves its source or enters the frame, and comes to a box."""
    if net.source is None:
        first = min(target.band for target in net.targets.values())
        return first, box.band
    here, there = net.source.band, box.band
    if here == there:
        return here + 1, here + 1
    return (here + 1, there) if there > here else (here, there + 1)


def _tracks(spans: Mapping[_Key, tuple[float, float]]) -> tuple[dict[_Key, int], int]:
    """Return a track for each span, so that those that meet have different ones, and how many there are."""
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


def _columns(boxes: Sequence[Box], nets: Sequence[Net]) -> list[list[Box]]:
    """Return the boxes by their distance from the sources, neighbours near to what they read."""
    after: dict[Box, list[Box]] = {box: [] for box in boxes}
    before: dict[Box, list[Box]] = {box: [] for box in boxes}
    for net in nets:
        for box in dict.fromkeys(net.targets.values()):
            if net.source and net.source is not box:
                after[net.source].append(box)
                before[box].append(net.source)
    order = _order(boxes, after, before)
    place = {box: index for index, box in enumerate(order)}
    depth = dict.fromkeys(boxes, 0)
    for box in order:
        for reader in after[box]:
            if place[reader] > place[box]:
                depth[reader] = max(depth[reader], depth[box] + 1)
    columns: list[list[Box]] = [[] for _ in range(max(depth.values()) + 1)]
    for box in boxes:
        columns[depth[box]].append(box)
    rank: dict[Box, float] = {}
    for column in columns:
        wish = {box: [rank[source] for source in before[box] if source in rank] for box in column}
        last = {box: index / len(column) for index, box in enumerate(column)}
        column.sort(key=lambda box: sum(wish[box]) / len(wish[box]) if wish[box] else last[box])
        rank.update({box: (index + 0.5) / len(column) for index, box in enumerate(column)})
    return columns


def _order(
    boxes: Sequence[Box], after: Mapping[Box, list[Box]], before: Mapping[Box, list[Box]]
) -> list[Box]:
    """Return the boxes in an order of flow: a walk from the sources cuts each loop where it comes back."""
    done: list[Box] = []
    seen: set[Box] = set()
    for start in [*(box for box in boxes if not before[box]), *boxes]:
        if start in seen:
            continue
        seen.add(start)
        trail = [(start, iter(after[start]))]
        while trail:
            box, readers = trail[-1]
            reader = next((reader for reader in readers if reader not in seen), None)
            if reader is None:
                done.append(box)
                trail.pop()
            else:
                seen.add(reader)
                trail.append((reader, iter(after[reader])))
    return done[::-1]


def _bands(columns: Sequence[Sequence[Box]], nets: Sequence[Net]) -> list[list[list[Box]]]:
    """Split columns that are too high, fold the row of them, and stack the boxes in each."""
    area = sum((box.width + 3 * GAP) * (box.height + GAP) for column in columns for box in column)
    highest = max(LEAST_HEIGHT, math.sqrt(area / ASPECT))
    widest = max(LEAST_WIDTH, math.sqrt(area * ASPECT))
    bands: list[list[list[Box]]] = [[]]
    across = 0.0
    for column in columns:
        for part in _split(column, highest):
            width = max(box.width + max(box.reach.values(), default=0.0) for box in part) + 2 * GAP
            if bands[-1] and across + width > widest:
                bands.append([])
                across = 0.0
            for box in part:
                box.band, box.column = len(bands) - 1, len(bands[-1])
            bands[-1].append(part)
            across += width
    _stack(bands, nets)
    return bands


def _split(column: Sequence[Box], highest: float) -> Iterator[list[Box]]:
    part: list[Box] = []
    height = 0.0
    for box in column:
        if part and height + box.height > highest:
            yield part
            part, height = [], 0.0
        part.append(box)
        height += box.height + GAP
    yield part


def _stack(bands: Sequence[Sequence[Sequence[Box]]], nets: Sequence[Net]) -> None:
    """Set the heights of boxes below the top of their band, level with what they read where there is room."""
    wired: dict[Box, list[tuple[Box, float]]] = defaultdict(list)
    for net in nets:
        for (_, port), box in net.targets.items():
            if net.source and (net.source.band, net.source.column + 1) == (box.band, box.column):
                wired[box].append((net.source, net.source.ports[net.port] - box.ports[port]))
    for band in bands:
        for column in band:
            bottom = 0.0
            for box in column:
                wishes = sorted(source.y + shift for source, shift in wired[box])
                box.y = max(bottom, wishes[len(wishes) // 2]) if wishes else bottom
                bottom = box.y + box.height + GAP
