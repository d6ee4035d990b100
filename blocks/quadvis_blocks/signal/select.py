"""Elements of a vector, by their numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, OutOfRange, Param

NEAREST, REFUSE = range(2)


class Select(Block):
    """Elements of a vector, by numbers that may change: ``y = u[index]``, counted from 0.

    An index below the vector gives the first element and one beyond it the last, or ends the run. All
    elements have one unit. Elements that never change need no block: a wire ``x.y[2]`` or ``x.y[0:2]`` takes
    them, and `signal.concatenate` puts them into another order.
    """

    outside = Param("nearest", choices=("nearest", "refuse"), doc="what an index that is no element does")
    index = In("int64[*]", doc="the places of the elements, from 0")
    u = In("float64[n]", unit="a", doc="the vector")
    y = Out("float64[*]", unit="a", doc="an element for each index")

    example = """
        row: {block: sources.constant, rate: fast, with: {value: {value: [3, 5, 8], unit: m}}}
        two: {block: signal.select, rate: fast, in: {index: [2, 0], u: row.y}}
    """

    def output(self, index: Any, u: Any) -> Any:
        """Return the elements."""
        number = 1.0 * index  # compiled code can ask for a float, not for an int
        if isinstance(number, float):
            return u[_place(index, u.size, self.outside)]
        y = np.empty(index.shape)
        for place in range(index.size):
            y.flat[place] = u[_place(index.flat[place], u.size, self.outside)]
        return y


def _place(index: int, size: int, outside: int) -> int:
    if outside == REFUSE and not 0 <= index < size:
        raise OutOfRange("the index is no element of the vector, which counts from 0")
    return min(max(index, 0), size - 1)
