"""The thrust that carries a tilted craft."""

from __future__ import annotations

from math import cos

from quadvis.block import Block, In, Out, Param


class Thrust(Block):
    """A vertical force as thrust along the craft's axis."""

    weight = Param(0.0)
    force, theta, phi = In(), In(), In()
    y0 = Out()

    def output(self, force: float, theta: float, phi: float) -> float:
        """Return the thrust."""
        return (force + self.weight) / (cos(theta) * cos(phi))
