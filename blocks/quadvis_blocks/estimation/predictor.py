"""The state of the craft at the instant when a command sent now will act."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._angles import wrapped
from quadvis_blocks._craft import ARM, GRAVITY, INERTIA, MASS, MOTOR_LAG, RADIO_DELAY, TORQUE_RATIO
from quadvis_blocks._delay import check_delay
from quadvis_blocks.estimation._rotors import CAPACITY, acceleration, follow, send, start, wrench

STEP = 0.01  # s, at most


class Predictor(Block):
    """State of the craft when a command sent now will act, from the commands that are on their way.

    A command arrives ``delay`` later. Until then the motion follows from the commands sent so far. Then ``x +
    lag x'`` compensates the lag of the motors. For a law torque = K x this gives exactly the command that a
    first-order lag turns into K x, since ``command = torque + lag torque'``. So the law may be tuned as if
    there were neither radio nor motors: at 20 Hz, with a delay of 22 ms and a lag of 80 ms, the laws of the
    paper are stable up to a bandwidth of 10 rad/s instead of 3.3.

    Disturbances are taken as constant. Run the block at the rate of the control, and connect ``thrust`` to
    the thrusts that the control sends.

    Error: ParameterError if the delay is longer than 127 ticks.

    Source: for the delay, Artstein, Linear systems with delayed controls: a reduction (1982).
    """

    position = In("float64[3]", unit="m", doc="x, y, h, now")
    velocity = In("float64[3]", unit="m/s", doc="rate of change of the position")
    disturbance = In(
        "float64[3]",
        unit="m/s^2",
        default=(0.0, 0.0, 0.0),
        doc="acceleration in addition to thrust and gravity",
    )
    roll = In(unit="rad", doc="right side down is positive")
    pitch = In(unit="rad", doc="nose up is positive")
    yaw = In(unit="rad", doc="clockwise from above is positive")
    roll_rate = In(unit="rad/s", doc="rate of change of roll")
    pitch_rate = In(unit="rad/s", doc="rate of change of pitch")
    yaw_rate = In(unit="rad/s", doc="rate of change of yaw")
    roll_disturbance = In(unit="rad/s^2", default=0.0, doc="roll torque in addition to that of the rotors")
    pitch_disturbance = In(unit="rad/s^2", default=0.0, doc="pitch torque in addition to that of the rotors")
    yaw_disturbance = In(unit="rad/s^2", default=0.0, doc="yaw torque in addition to that of the rotors")
    thrust = In("float64[4]", unit="N", doc="commanded thrust of each rotor: front, right, rear, left")
    later_position = Out("float64[3]", unit="m", doc="x, y, h when the command acts")
    later_velocity = Out("float64[3]", unit="m/s", doc="velocity when the command acts")
    later_roll = Out(unit="rad", doc="roll when the command acts")
    later_pitch = Out(unit="rad", doc="pitch when the command acts")
    later_yaw = Out(unit="rad", doc="yaw when the command acts, in (-pi, pi]")
    later_rates = Out(
        "float64[3]", unit="rad/s", doc="rates of change of roll, pitch and yaw when the command acts"
    )

    delay = Param(
        RADIO_DELAY, unit="s", min=0.0, max=1.0, shown=True, doc="time from sending a command to its arrival"
    )
    lag = Param(MOTOR_LAG, unit="s", above=0.0, doc="time constant of a motor")
    arm = Param(ARM, unit="m", above=0.0, doc="l, from the centre to each rotor; default: Draganfly IV")
    inertia = Param(
        INERTIA, type="float64[3]", unit="kg*m^2", above=0.0, doc="about roll, pitch and yaw axis"
    )
    torque_ratio = Param(TORQUE_RATIO, unit="m", above=0.0, doc="c, drag torque of a rotor over its thrust")
    mass = Param(MASS, unit="kg", above=0.0, tune=True, doc="mass of the craft; default: Draganfly IV")
    gravity = Param(GRAVITY, unit="m/s^2", above=0.0, doc="g")

    times = State(f"float64[{CAPACITY}]", unit="s")  # at which commands arrive
    commands = State(f"float64[{CAPACITY},4]")
    count = State("int64", 1)
    now = State("float64[4]")  # the wrench of the rotors

    example = """
        turn: {block: sources.sine, rate: fast, with: {amplitude: 5 deg, frequency: 1 Hz}}
        rate: {block: signal.derivative, rate: fast, in: {u: turn.y}}
        later:
          block: estimation.predictor
          rate: fast
          in:
            position: {value: [0, 0, 1.5], unit: m}
            velocity: {value: [0.2, 0, 0], unit: m/s}
            roll: turn.y
            pitch: 0 rad
            yaw: 0 rad
            roll_rate: rate.rate
            pitch_rate: 0 rad/s
            yaw_rate: 0 rad/s
            thrust: {value: [1.2, 1.2, 1.2, 1.2], unit: N}
    """

    def check(self) -> None:
        """Refuse a delay that holds more commands than there is room for."""
        check_delay(self.delay, CAPACITY - 1, self.period)

    def start(self) -> None:
        """Begin in a trimmed hover."""
        start(self.times, self.commands, self.now, self.mass * self.gravity)
        self.count = 1

    def output(
        self,
        position: Any,
        velocity: Any,
        disturbance: Any,
        roll: float,
        pitch: float,
        yaw: float,
        roll_rate: float,
        pitch_rate: float,
        yaw_rate: float,
        roll_disturbance: float,
        pitch_disturbance: float,
        yaw_disturbance: float,
        time: float,
    ) -> tuple[Any, Any, float, float, float, Any]:
        """Return the state when a command sent now will act."""
        place, speed, now, mean = position.copy(), velocity.copy(), self.now.copy(), np.zeros(4)
        angles, rates = np.array((roll, pitch, yaw)), np.array((roll_rate, pitch_rate, yaw_rate))
        trim = np.array((roll_disturbance, pitch_disturbance, yaw_disturbance))
        count = int(self.delay / STEP) + 1
        step = self.delay / count
        for index in range(count):
            at = time + index * step
            follow(self.times, self.commands, self.count, now, at, at + step, self.lag, mean)
            push = disturbance + acceleration(mean[0], angles + 0.5 * step * rates, self.mass, self.gravity)
            turn = trim + mean[1:]
            place += step * (speed + 0.5 * step * push)
            speed += step * push
            angles += step * (rates + 0.5 * step * turn)
            rates += step * turn
        push = disturbance + acceleration(now[0], angles, self.mass, self.gravity)
        lead = angles + self.lag * rates
        return (
            place + self.lag * speed,
            speed + self.lag * push,
            float(lead[0]),
            float(lead[1]),
            wrapped(float(lead[2])),
            rates + self.lag * (trim + now[1:]),
        )

    def update(self, thrust: Any, time: float) -> None:
        """Send a command, and follow the commands that arrive until the next tick."""
        command = wrench(thrust, self.arm, self.inertia, self.torque_ratio)
        self.count = send(self.times, self.commands, self.count, time, self.delay, command)
        mean = np.zeros(4)
        follow(self.times, self.commands, self.count, self.now, time, time + self.period, self.lag, mean)
