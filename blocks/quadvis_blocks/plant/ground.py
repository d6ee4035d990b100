"""The ground under the craft."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State

SLIP = 0.01  # m/s; slower than this the friction is viscous


class Ground(Block):
    """The force of level ground on the craft: a spring and a damper that only push, and dry friction.

    With d = height - h > 0 the normal force is ``max(0, stiffness d - damping h')``; friction opposes the
    horizontal velocity with ``friction`` times that. Above the ground the force is zero. It acts on the
    centre of mass: the ground does not level the craft. The defaults carry 0.5 kg on 1 cm, well damped.
    """

    height = Param(0.0, unit="m", tune=True, doc="height of the craft as its feet touch the ground")
    stiffness = Param(500.0, unit="N/m", above=0.0, tune=True, doc="force for each metre of its feet bent")
    damping = Param(20.0, unit="N*s/m", min=0.0, tune=True, doc="force for each m/s of sinking")
    friction = Param(0.6, min=0.0, tune=True, doc="friction over normal force")
    position = In("float64[3]", unit="m", doc="x, y, h of the craft")
    velocity = In("float64[3]", unit="m/s", doc="rate of change of the position")
    force = Out("float64[3]", unit="N", doc="force on the craft along x, y, h")
    contact = Out("bool", doc="whether the feet touch the ground")
    impact = Out(unit="m/s", doc="greatest speed at which they came down on it so far")
    touching = State("bool")
    hardest = State(unit="m/s")

    def output(self, position: Any, velocity: Any) -> tuple[Any, bool, float]:
        """Return the force, whether there is contact, and how hard it was."""
        depth = self.height - position[2]
        if depth <= 0.0:
            return np.zeros(3), False, self.hardest
        impact = self.hardest if self.touching else max(self.hardest, -velocity[2])
        normal = max(0.0, self.stiffness * depth - self.damping * velocity[2])
        drag = self.friction * normal / max(SLIP, math.hypot(velocity[0], velocity[1]))
        return np.array((-drag * velocity[0], -drag * velocity[1], normal)), True, impact

    def update(self, position: Any, velocity: Any) -> None:
        """Keep the speed of a touch-down."""
        touching = bool(position[2] < self.height)
        if touching and not self.touching:
            self.hardest = max(self.hardest, -velocity[2])
        self.touching = touching
