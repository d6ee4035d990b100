"""Several signals as one vector."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out


class Concatenate(Block):
    """Scalars and vectors one after the other, as one vector: ``y = (u[0], u[1], ...)``, such as x, y and h.

    Each element keeps its unit. The wires of readers take it apart: ``y[2]``, ``y[0:2]``.
    """

    u = In("float64[n?]", unit="a", many=True, doc="scalars and vectors")
    y = Out("float64[n]", unit="a", doc="all their elements, in the order of the list")

    symbol = "bar"
    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        position: {block: signal.concatenate, rate: fast, in: {u: [wave.y, 0 m, 1.5 m]}}
    """

    @classmethod
    def ports(cls, u: int) -> dict[str, Any]:
        """Return inputs that have a length and a unit each, and an output that is as long as all of them."""
        sizes, units = [f"n_{k}" for k in range(u)], [f"a_{k}" for k in range(u)]
        return {
            "u": [
                In(f"float64[{size}?]", unit=unit, doc="a scalar or a vector")
                for size, unit in zip(sizes, units, strict=True)
            ],
            "y": Out(f"float64[{'+'.join(sizes)}]", unit=" ".join(units), doc="all their elements"),
        }

    def output(self, *u: Any) -> Any:
        """Return the vector."""
        return np.concatenate(u)
