"""Lines of dots in braille characters: 2 x 4 dots in a cell, so a terminal shows fine curves."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

WIDE, HIGH = 2, 4  # dots of a cell
_BLANK = 0x2800
_BITS = ((0x01, 0x08), (0x02, 0x10), (0x04, 0x20), (0x40, 0x80))  # by row and column of a cell
# Dots that are set and left out in turn: full, dashed, dotted, dash and dot.
STYLES: tuple[tuple[int, ...], ...] = ((1, 0), (5, 3), (1, 2), (5, 2, 1, 2))

Points = NDArray[np.float64]


class DotGrid:
    """Cells of braille dots, each with the number of the curve that was drawn there last.

    Dots are counted from the left and from the top; what lies outside is left out.
    """

    def __init__(self, width: int, height: int) -> None:
        """Begin with ``width`` x ``height`` empty cells."""
        self.width, self.height = width, height
        self._bits = [[0] * width for _ in range(height)]
        self._owners = [[-1] * width for _ in range(height)]

    def draw(self, x: Points, y: Points, owner: int, style: Sequence[int] = STYLES[0]) -> None:
        """Join points (N,), in dots, by lines; what is not finite interrupts them."""
        cycle = [not number % 2 for number, count in enumerate(style) for _ in range(count)]
        path = _path(*_thinned(x, y), self.height * HIGH)
        for (column, row), shown in zip(path, itertools.cycle(cycle), strict=False):
            if shown:
                self._set(column, row, owner)

    def _set(self, column: int, row: int, owner: int) -> None:
        line, cell = row // HIGH, column // WIDE
        if row >= 0 and column >= 0 and line < self.height and cell < self.width:
            self._bits[line][cell] |= _BITS[row % HIGH][column % WIDE]
            self._owners[line][cell] = owner

    @property
    def right(self) -> int:
        """The number of the last dot of a line."""
        return self.width * WIDE - 1

    @property
    def bottom(self) -> int:
        """The number of the last dot of a column."""
        return self.height * HIGH - 1

    def line(self, number: int) -> list[tuple[str, int]]:
        """Return a line of cells: a character and the curve that was drawn there last; "", -1 if empty."""
        cells = zip(self._bits[number], self._owners[number], strict=True)
        return [(chr(_BLANK + bits) if bits else "", owner) for bits, owner in cells]


def _thinned(x: Points, y: Points) -> tuple[Points, Points]:
    """Return at most four points for each column of dots: the first, least, greatest and last of many."""
    columns = np.floor(x)
    borders = np.flatnonzero(np.diff(columns, prepend=np.nan) != 0)
    if len(x) <= 4 * len(borders) or not np.isfinite(y).all():
        return x, y
    kept: list[int] = []
    starts = borders.tolist()
    for start, stop in zip(starts, [*starts[1:], len(x)], strict=True):
        part = y[start:stop]
        kept += sorted({start, start + int(part.argmin()), start + int(part.argmax()), stop - 1})
    return x[kept], y[kept]


def _path(x: Points, y: Points, high: int) -> Iterator[tuple[int, int]]:
    """Yield the dots of a line through points, each once in its place."""
    before: tuple[int, int] | None = None
    for column, row in zip(x.tolist(), y.tolist(), strict=True):
        if not math.isfinite(row):
            before = None
            continue
        # A value far outside is drawn as one a little outside: the line leaves the picture all the same.
        point = round(column), round(min(max(row, -high), 2.0 * high))
        if before is None:
            yield point
        elif point != before:
            yield from _line(before, point)
        before = point


def _line(start: tuple[int, int], end: tuple[int, int]) -> Iterator[tuple[int, int]]:
    """Yield the dots between two, without the first one."""
    across, down = end[0] - start[0], end[1] - start[1]
    count = max(abs(across), abs(down))
    for step in range(1, count + 1):
        yield round(start[0] + across * step / count), round(start[1] + down * step / count)
