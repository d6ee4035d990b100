"""From collective thrust and torques to the thrusts of four rotors."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, clip
from quadvis_blocks._craft import ARM, INERTIA, THRUST_MAX, TORQUE_RATIO

ROUNDING = 1e-12  # N; a demand exactly at a limit does not count as saturated


class Mixer(Block):
    """Thrust of each rotor that gives the wanted collective thrust and torques, within the rotors' limits.

    Rotors: 0 front, 1 right, 2 rear, 3 left; front and rear turn counterclockwise seen from above. Within the
    limits the mixer is the exact inverse of u = f0 + f1 + f2 + f3, Ix roll = l (f3 - f1), Iy pitch =
    l (f0 - f2), Iz yaw = c (f0 + f2 - f1 - f3).

    Beyond the limits the controls give way in this order, each by as little as possible: yaw first (if
    necessary it changes sign), then the collective, at last roll and pitch in proportion to each other. Every
    thrust lies within the limits for all inputs. ``given`` is the collective and the torques that the thrusts
    produce; ``limited`` marks the controls that gave way. Integrators and disturbance estimates use ``given``
    as their input, or stand still while ``limited`` is true.

    Source: section 3 in words; the numbering and the order of giving way are additions.
    """

    arm = Param(ARM, unit="m", above=0.0, doc="l, from the centre to each rotor; default: Draganfly IV")
    inertia = Param(
        INERTIA, type="float64[3]", unit="kg*m^2", above=0.0, doc="about roll, pitch and yaw axis"
    )
    torque_ratio = Param(
        TORQUE_RATIO, unit="m", above=0.0, doc="c, drag torque of a rotor divided by its thrust"
    )
    thrust_min = Param(0.0, unit="N", min=0.0, doc="least thrust of a rotor")
    thrust_max = Param(THRUST_MAX, unit="N", above=0.0, doc="greatest thrust of a rotor")
    collective = In(unit="N", doc="collective thrust u")
    roll = In(unit="rad/s^2", doc="roll torque divided by inertia")
    pitch = In(unit="rad/s^2", doc="pitch torque divided by inertia")
    yaw = In(unit="rad/s^2", doc="yaw torque divided by inertia")
    thrust = Out("float64[4]", unit="N", doc="thrust of each rotor: front, right, rear, left")
    saturated = Out("bool", doc="whether a control gave way")
    given = Out(
        "float64[4]",
        unit="N rad/s^2 rad/s^2 rad/s^2",
        doc="controls that the thrusts produce: collective; roll, pitch and yaw torque over inertia",
    )
    limited = Out("bool[4]", doc="controls that gave way: collective, roll, pitch, yaw")

    example = """
        torque: {block: sources.sine, rate: fast, with: {amplitude: 8 rad/s^2, frequency: 1 Hz}}
        mixer:
          block: control.mixer
          rate: fast
          in: {collective: 5 N, roll: torque.y, pitch: 0 rad/s^2, yaw: 0.2 rad/s^2}
    """

    def check(self) -> None:
        """Refuse a least thrust that is not below the greatest."""
        if self.thrust_min >= self.thrust_max:
            problem = f"thrust_min must be below thrust_max, {self.thrust_max:g} N, got {self.thrust_min:g} N"
            raise ParameterError("thrust_min", problem)

    def output(self, collective: float, roll: float, pitch: float, yaw: float) -> tuple[Any, bool, Any, Any]:
        """Return the thrusts, whether a control gave way, the controls produced, and which gave way."""
        least, most = self.thrust_min, self.thrust_max
        # Thrust of one rotor for one unit of torque over inertia.
        per_roll = 0.5 * self.inertia[0] / self.arm
        per_pitch = 0.5 * self.inertia[1] / self.arm
        per_yaw = 0.25 * self.inertia[2] / self.torque_ratio
        side, front, turn, mean = per_roll * roll, per_pitch * pitch, per_yaw * yaw, 0.25 * collective
        reach = max(abs(side), abs(front))
        half = 0.5 * (most - least)
        steep = reach > half
        if steep:
            side, front = side * half / reach, front * half / reach
        # Yaw is still free, so opposite rotors share the range that roll and pitch leave.
        room = half - 0.5 * (abs(side) + abs(front))
        allowed = clip(mean, least + half - room, least + half + room)
        lowest = max(least + abs(front) - allowed, allowed + abs(side) - most)
        highest = min(most - abs(front) - allowed, allowed - abs(side) - least)
        turned = clip(turn, lowest, highest)
        high, slow = abs(allowed - mean) > ROUNDING, abs(turned - turn) > ROUNDING
        thrusts = np.array(
            (
                allowed + front + turned,
                allowed - side - turned,
                allowed - front + turned,
                allowed + side - turned,
            )
        )
        return (
            np.minimum(np.maximum(thrusts, least), most),
            steep or high or slow,
            np.array((4.0 * allowed, side / per_roll, front / per_pitch, turned / per_yaw)),
            np.array((high, steep and side != 0.0, steep and front != 0.0, slow)),
        )
