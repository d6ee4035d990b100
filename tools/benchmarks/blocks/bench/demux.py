"""Twelve scalars out of a vector."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out


class Demux(Block):
    """The elements of a vector, one by one."""

    u = In("float64[12]")
    y0, y1, y2, y3, y4, y5 = Out(), Out(), Out(), Out(), Out(), Out()
    y6, y7, y8, y9, y10, y11 = Out(), Out(), Out(), Out(), Out(), Out()

    def output(self, u: Any) -> tuple[float, ...]:
        """Return the elements."""
        return u[0], u[1], u[2], u[3], u[4], u[5], u[6], u[7], u[8], u[9], u[10], u[11]
