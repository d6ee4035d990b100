"""A weighted sum."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param


class Weighted(Block):
    """The sum of up to five signals, each times its weight."""

    w0, w1, w2, w3, w4 = Param(0.0), Param(0.0), Param(0.0), Param(0.0), Param(0.0)
    u0, u1, u2 = In(default=0.0), In(default=0.0), In(default=0.0)
    u3, u4 = In(default=0.0), In(default=0.0)
    y0 = Out()

    def output(self, u0: float, u1: float, u2: float, u3: float, u4: float) -> float:
        """Return the sum."""
        return self.w0 * u0 + self.w1 * u1 + self.w2 * u2 + self.w3 * u3 + self.w4 * u4
