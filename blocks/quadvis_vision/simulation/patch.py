"""Parts of a picture: boxes of pixels around discs."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Singles = NDArray[np.float32]
Box = tuple[slice, slice]  # rows, columns


class Patch(NamedTuple):
    """The `box` of the picture that a `disc` (by its index) can touch, and its `part` of all their pixels."""

    disc: int
    box: Box
    part: slice

    @property
    def shape(self) -> tuple[int, int]:
        """Number of rows and columns."""
        rows, columns = self.box
        return rows.stop - rows.start, columns.stop - columns.start

    def of(self, values: Singles) -> Singles:
        """Return the box (..., rows, columns) of values (..., n) of all pixels, to be read or written."""
        return values[..., self.part].reshape(*values.shape[:-1], *self.shape)


def meet(box: Box, other: Box) -> bool:
    """Return whether two boxes have pixels in common."""
    (rows, columns), (others, beside) = box, other
    if rows.start >= others.stop or others.start >= rows.stop:
        return False
    return bool(columns.start < beside.stop and beside.start < columns.stop)


def overlap(box: Box, other: Box) -> tuple[Box, Box]:
    """Return the common part of two boxes, in the coordinates of the first and of the second."""
    here, there = [], []
    for mine, theirs in zip(box, other, strict=True):
        first, last = max(mine.start, theirs.start), min(mine.stop, theirs.stop)
        here.append(slice(first - mine.start, last - mine.start))
        there.append(slice(first - theirs.start, last - theirs.start))
    return (here[0], here[1]), (there[0], there[1])
