"""The ground under the craft."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State, Work

SLIP = 0.01  # m/s; at lower speeds the friction is viscous


class Ground(Block):
    """Force and torque of level ground on the craft: four feet with springs and dampers that only push.

    The feet are under the rotors, at a distance ``feet`` from the centre. The height h of a foot is the
    height of the craft plus the part from roll and pitch. A foot at the depth d = ``height`` - h below the
    ground is pushed up with ``max(0, stiffness d - damping h') / 4``. So the ground levels a craft that
    stands on it. Dry friction opposes the horizontal velocity and the rotation about the yaw axis; its force
    is ``friction`` times the force of all feet. Above the ground force and torque are zero. With the defaults
    a craft of 0.5 kg sinks in by 1 cm, and its motion is well damped vertically and about roll and pitch.
    Without ``attitude`` and ``rates`` the craft is level.

    Error: friction acts at the height of the centre of mass, so it cannot tip the craft over.
    """

    height = Param(0.0, unit="m", tune=True, doc="height of the craft when its feet touch the ground")
    feet = Param(0.15, unit="m", min=0.0, doc="distance of each foot from the centre; 0: no torque")
    stiffness = Param(500.0, unit="N/m", above=0.0, tune=True, doc="force of all feet per metre of depth")
    damping = Param(20.0, unit="N*s/m", min=0.0, tune=True, doc="force of all feet per m/s of sinking")
    friction = Param(0.6, min=0.0, tune=True, doc="friction divided by normal force")
    position = In("float64[3]", unit="m", doc="x, y, h of the craft")
    velocity = In("float64[3]", unit="m/s", doc="rate of change of the position")
    attitude = In("float64[3]", unit="rad", default=(0.0, 0.0, 0.0), doc="roll, pitch, yaw")
    rates = In("float64[3]", unit="rad/s", default=(0.0, 0.0, 0.0), doc="about roll, pitch and yaw axis")
    force = Out("float64[3]", unit="N", doc="force on the craft along x, y, h")
    torque = Out("float64[3]", unit="N*m", doc="torque on the craft about roll, pitch and yaw axis")
    contact = Out("bool", doc="whether a foot touches the ground")
    impact = Out(unit="m/s", doc="greatest speed of a touch-down so far")
    touching = State("bool")
    hardest = State(unit="m/s")
    touching_now = Work("bool")
    hardest_now = Work(unit="m/s")

    example = """
        drop:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: {value: [[0, 0, 0.02], [0, 0, -0.03]], unit: m}}
        ground:
          block: plant.ground
          rate: fast
          in: {position: drop.y, velocity: {value: [0, 0, -0.05], unit: m/s}}
    """

    def output(self, position: Any, velocity: Any, attitude: Any, rates: Any) -> tuple[Any, Any, bool, float]:
        """Return force and torque, whether a foot touches the ground, and the greatest impact so far."""
        depth, climb = self.height - float(position[2]), float(velocity[2])
        nose, side, upright = _tilt(attitude)
        span, spring, damper = self.feet, 0.25 * self.stiffness, 0.25 * self.damping
        lean = max(abs(nose), abs(side))
        self.touching_now = float(position[2]) - span * lean < self.height
        touched = self.touching_now and not self.touching
        self.hardest_now = max(self.hardest, -climb) if touched else self.hardest
        if depth + span * lean <= 0.0:
            return np.zeros(3), np.zeros(3), False, self.hardest
        impact = self.hardest if self.touching else max(self.hardest, -climb)
        arm = span * upright
        pitching, rolling = arm * float(rates[1]), arm * float(rates[0])
        front = max(0.0, spring * (depth - span * nose) - damper * (climb + pitching))
        rear = max(0.0, spring * (depth + span * nose) - damper * (climb - pitching))
        right = max(0.0, spring * (depth + span * side) - damper * (climb - rolling))
        left = max(0.0, spring * (depth - span * side) - damper * (climb + rolling))
        normal = front + right + rear + left
        speed = math.sqrt(velocity[0] * velocity[0] + velocity[1] * velocity[1])
        drag = self.friction * normal / max(SLIP, speed)
        turning = span * float(rates[2])
        brake = self.friction * normal * span * turning / max(SLIP, abs(turning))
        return (
            np.array((-drag * velocity[0], -drag * velocity[1], normal)),
            np.array((arm * (left - right), arm * (front - rear), -brake)),
            True,
            impact,
        )

    def update(self) -> None:
        """Keep the speed of a touch-down."""
        self.touching, self.hardest = self.touching_now, self.hardest_now


def _tilt(attitude: Any) -> tuple[float, float, float]:
    """Return the rise of nose and left side per metre from the centre, and the cosine of the tilt."""
    roll, pitch = float(attitude[0]), float(attitude[1])
    cosine = math.cos(pitch)
    return math.sin(pitch), math.sin(roll) * cosine, math.cos(roll) * cosine
