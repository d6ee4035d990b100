"""The present thrust and torques of the rotors, from the commands that were sent."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._craft import ARM, GRAVITY, INERTIA, MOTOR_LAG, RADIO_DELAY, TORQUE_RATIO
from quadvis_blocks._delay import check_delay
from quadvis_blocks.estimation._rotors import CAPACITY, follow, send, start, wrench


class RotorState(Block):
    """Present thrust and torques of the rotors, from a model of radio and motors.

    A command arrives ``delay`` later and holds until the next command arrives; the rotors follow with a
    first-order lag. The model is exact between ticks. So the block may run faster than the commands come, and
    a command may arrive between two ticks. With ``across: hold`` in a simulation, a command enters the block
    at most one tick late.

    Error: none beyond that of the model; ParameterError if the delay is longer than 127 ticks.
    """

    thrust = In("float64[4]", unit="N", doc="commanded thrust of each rotor: front, right, rear, left")
    collective = Out(unit="N", doc="sum of the thrusts, now")
    torque = Out(
        "float64[3]", unit="rad/s^2", doc="about roll, pitch, yaw over inertia: mean until the next tick"
    )

    delay = Param(
        RADIO_DELAY, unit="s", min=0.0, shown=True, doc="time from sending a command to its arrival"
    )
    lag = Param(MOTOR_LAG, unit="s", above=0.0, doc="time constant of a motor")
    arm = Param(ARM, unit="m", above=0.0, doc="l, from the centre to each rotor; default: Draganfly IV")
    inertia = Param(
        INERTIA, type="float64[3]", unit="kg*m^2", above=0.0, doc="about roll, pitch and yaw axis"
    )
    torque_ratio = Param(TORQUE_RATIO, unit="m", above=0.0, doc="c, drag torque of a rotor over its thrust")
    mass = Param(
        0.5, unit="kg", above=0.0, doc="mass of the craft, whose weight the rotors carry at the start"
    )
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")
    times = State(f"float64[{CAPACITY}]", unit="s")  # at which commands arrive
    commands = State(f"float64[{CAPACITY},4]")
    count = State("int64", 1)
    now = State("float64[4]")

    example = """
        command:
          block: sources.table
          rate: fast
          with:
            times: {value: [0, 0.2], unit: s}
            values: {value: [[1.2, 1.2, 1.2, 1.2], [1.3, 1.2, 1.1, 1.2]], unit: N}
            interpolation: hold
        rotors: {block: estimation.rotor_state, rate: fast, in: {thrust: command.y}}
    """

    def check(self) -> None:
        """Refuse a delay that holds more commands than there is room for."""
        check_delay(self.delay, CAPACITY - 1, self.period)

    def start(self) -> None:
        """Begin in a trimmed hover."""
        start(self.times, self.commands, self.now, self.mass * self.gravity)
        self.count = 1

    def output(self, time: float) -> tuple[float, Any]:
        """Return the collective thrust, and the torques of the coming period."""
        now, mean = self.now.copy(), np.zeros(4)
        follow(self.times, self.commands, self.count, now, time, time + self.period, self.lag, mean)
        return float(self.now[0]), mean[1:]

    def update(self, thrust: Any, time: float) -> None:
        """Send a command, and follow the commands that arrive until the next tick."""
        command = wrench(thrust, self.arm, self.inertia, self.torque_ratio)
        self.count = send(self.times, self.commands, self.count, time, self.delay, command)
        mean = np.zeros(4)
        follow(self.times, self.commands, self.count, self.now, time, time + self.period, self.lag, mean)
