"""The thrusts that the commands of motors ask for."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError
from quadvis_blocks._craft import THRUST_MAX
from quadvis_blocks._thrust_curve import CURVE, thrust_share

ROTORS = 4


class MotorThrust(Block):
    """Thrust of each rotor from the commands that a flight controller gives its motors.

    ``thrust = thrust_max ((1 - curve) u + curve u^2)`` for a command u, held to 0 to 1. The lag of the motors
    is that of the craft. ``order`` says which motor is which rotor: by default those of Betaflight's mixer
    QUADP, whose motors are rear, right, left, front; with ``yaw_motors_reversed`` they turn as those of
    `plant.rotorcraft` do.

    Source: the curve is that of PX4's parameter THR_MDL_FAC.
    """

    thrust_max = Param(THRUST_MAX, unit="N", above=0.0, doc="greatest thrust of a rotor")
    curve = Param(CURVE, min=0.0, max=1.0, doc="share of the thrust that goes by the square of the command")
    order = Param(
        (4, 2, 1, 3), type="int64[4]", min=1, max=ROTORS, doc="motor of front, right, rear, left, from 1"
    )
    command = In("float64[4]", doc="command of each motor, 0 to 1")
    thrust = Out("float64[4]", unit="N", doc="commanded thrust of each rotor: front, right, rear, left")

    example = """
        command:
          block: sources.table
          rate: fast
          with: {times: {value: [0, 1], unit: s}, values: [[0, 0, 0, 0], [1, 0.5, 1, 0.5]]}
        rotors: {block: plant.motor_thrust, rate: fast, in: {command: command.y}}
    """

    def check(self) -> None:
        """Refuse a motor that turns two rotors."""
        if len(np.unique(self.order)) < ROTORS:
            raise ParameterError("order", "order must name each motor once")

    def output(self, command: Any) -> Any:
        """Return the thrusts."""
        thrust = np.zeros(ROTORS)
        for rotor in range(ROTORS):
            share = thrust_share(float(command[self.order[rotor] - 1]), self.curve)
            thrust[rotor] = self.thrust_max * share
        return thrust
