"""Boxes and nets of one level of a large diagram, and the column and band in which each box stands.

Boxes stand in columns by their distance from the sources; columns that are too high are split, and the row of
columns is folded into bands like the lines of a text.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

ASPECT = 1.6  # of a picture: width divided by height
GAP = 26.0  # pixels between boxes
LEAST_WIDTH, LEAST_HEIGHT = 1400.0, 700.0  # narrower bands and lower columns are never folded or split

Point = tuple[float, float]


@dataclass(eq=False)
class Box:
    """A block or a part. ``ports`` gives each port's height below its top, ``reach`` the gap before it."""

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
    """The wires of one output on a level: to ports of boxes, and to the frame's right side if it ``leaves``.

    A net without a source enters at the left side of the frame. It passes the frame at ``height``.
    """

    port: str
    source: Box | None
    targets: dict[tuple[str, str], Box] = field(default_factory=dict)
    leaves: bool = False
    height: float = 0.0
    ways: dict[tuple[str, str], list[Point]] = field(default_factory=dict)
    way_out: list[Point] = field(default_factory=list)

    def reach_for(self, box: Box, port: str) -> None:
        """Add a port that the net drives."""
        self.targets[box.id, port] = box

    @property
    def is_terminal(self) -> bool:
        """True if the net passes the frame."""
        return self.leaves or self.source is None

    @property
    def boxes(self) -> list[Box]:
        """All boxes at which the net ends."""
        return [*([self.source] if self.source else []), *self.targets.values()]


def in_columns(boxes: Sequence[Box], nets: Sequence[Net]) -> list[list[Box]]:
    """Return columns of boxes by their distance from the sources, each box near the boxes that it reads."""
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
    """Return the boxes in order of flow: a walk from the sources cuts each loop where it closes."""
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


def in_bands(
    columns: Sequence[Sequence[Box]], nets: Sequence[Net], least: float = LEAST_WIDTH
) -> list[list[list[Box]]]:
    """Split columns that are too high, fold the row of columns into bands, and stack the boxes.

    Bands that are narrower than ``least`` (pixels) are not folded.
    """
    area = sum((box.width + 3 * GAP) * (box.height + GAP) for column in columns for box in column)
    highest = max(LEAST_HEIGHT, math.sqrt(area / ASPECT))
    widest = max(least, math.sqrt(area * ASPECT))
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
    """Set the heights of boxes in their band, level with the boxes that they read where there is room."""
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
