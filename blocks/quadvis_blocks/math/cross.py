"""The cross product of two vectors in space."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out


class Cross(Block):
    """The cross product ``y = a x b`` of two vectors in space, such as the torque of a force at an arm."""

    a = In("float64[3]", unit="a", doc="a vector")
    b = In("float64[3]", unit="b", doc="another vector")
    y = Out("float64[3]", unit="a*b", doc="the cross product")

    example = """
        arm: {block: sources.constant, rate: fast, with: {value: {value: [0.2, 0, 0], unit: m}}}
        force: {block: sources.constant, rate: fast, with: {value: {value: [0, 0, 3], unit: N}}}
        torque: {block: math.cross, rate: fast, in: {a: arm.y, b: force.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the product."""
        return ("a × b",)  # noqa: RUF001

    def output(self, a: Any, b: Any) -> Any:
        """Return the vector."""
        return np.array((
            a[1] * b[2] - a[2] * b[1],
            a[2] * b[0] - a[0] * b[2],
            a[0] * b[1] - a[1] * b[0],
        ))  # fmt: skip
