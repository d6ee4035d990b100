"""Coulomb and viscous friction."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, element


class Friction(Block):
    """The force of Coulomb and viscous friction: ``y = sign(u) (coulomb + viscous |u|)``, 0 at rest.

    It follows from the speed alone, element by element. So a body under it never rests for good: it trembles
    around speed 0, by at most one step of the solver times its acceleration. `plant.sliding_mass` sticks.
    """

    jumps = "plant.sliding_mass"
    coulomb = Param(
        1.0, type="float64[*?]", unit="b", min=0.0, tune=True, shown=True, doc="the force at any speed"
    )
    viscous = Param(
        0.0,
        type="float64[*?]",
        unit="b/a",
        min=0.0,
        tune=True,
        shown=True,
        doc="the force for each unit of speed",
    )
    u = In("float64[*]", unit="a", doc="the speed")
    y = Out("float64[*]", unit="b", doc="the force, in the direction of the speed")

    symbol = "friction"
    example = """
        speed: {block: sources.sine, rate: fast, with: {amplitude: 1 m/s, frequency: 1 Hz}}
        drag:
          block: signal.friction
          rate: fast
          with: {coulomb: 1.5 N, viscous: 0.4 N*s/m}
          in: {u: speed.y}
    """

    def output(self, u: Any) -> Any:
        """Return the force."""
        if isinstance(u, float):
            return _force(u, self.coulomb, self.viscous)
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = _force(u.flat[index], element(self.coulomb, index), element(self.viscous, index))
        return y


def _force(speed: float, coulomb: float, viscous: float) -> float:
    if speed > 0.0:
        return coulomb + viscous * speed
    return viscous * speed - coulomb if speed < 0.0 else 0.0 * speed
