"""The dot product of two vectors."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out


class Dot(Block):
    """The dot product ``y = a[0] b[0] + a[1] b[1] + ...``, added up in this order."""

    a = In("float64[n?]", unit="a", doc="a vector")
    b = In("float64[n?]", unit="b", doc="another one of that length")
    y = Out(unit="a*b", doc="the dot product")

    example = """
        force: {block: sources.constant, rate: fast, with: {value: {value: [1, 2, 0], unit: N}}}
        speed: {block: sources.constant, rate: fast, with: {value: {value: [3, 0, 1], unit: m/s}}}
        power: {block: math.dot, rate: fast, in: {a: force.y, b: speed.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the product."""
        return ("a · b",)

    def output(self, a: Any, b: Any) -> float:
        """Return the sum of the products."""
        total = a[0] * b[0]
        for index in range(1, len(a)):
            total += a[index] * b[index]
        return float(total)
