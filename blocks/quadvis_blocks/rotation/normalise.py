"""The direction of a vector."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out
from quadvis_blocks._rotations import length


class Normalise(Block):
    """A vector over its length, such as a quaternion of norm 1: ``y = u / |u|``.

    A vector of length 0 has no direction, and ends the run.
    """

    u = In("float64[n]", unit="a", doc="a vector")
    y = Out("float64[n]", doc="the vector of length 1")
    norm = Out(unit="a", doc="the length of the input")

    example = """
        position: {block: sources.constant, rate: fast, with: {value: [3 m, 4 m]}}
        direction: {block: rotation.normalise, rate: fast, in: {u: position.y}}
    """

    def output(self, u: Any) -> Any:
        """Return the direction and the length."""
        norm = length(u)
        return u / norm, norm
