"""A model of an autopilot in the place of a real one, for simulations."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Input, Param, State, Work, all_finite, copied, reached
from quadvis_blocks.mavlink._arming import ARM, DONE, IDLE
from quadvis_blocks.mavlink._autopilot_ports import AutopilotPorts


class SimulatedAutopilot(AutopilotPorts, Block):
    """Stands in for `mavlink.autopilot`, with the same outputs: attitude, inertial unit and place as is.

    All come at each tick, so all ages are 0; what is not connected is missing, as with an autopilot that does
    not send it. It is armed ``delay`` after ``arm`` asks for it, in ``mode_number``, and disarmed in the same
    way. Errors of sensors are the matter of `sensors.imu`, which can stand before it.
    """

    age, lost, refused = Input.age, Input.lost, Input.refused
    delay = Param(0.5, unit="s", min=0.0, doc="from asking to arm or disarm until it is so")
    mode_number = Param(0, type="int64", min=0, doc="number of the mode that it is in")
    attitude = In("float64[3]", unit="rad", doc="roll, pitch, yaw")
    body_rates = In("float64[3]", unit="rad/s", doc="about roll, pitch and yaw axis")
    force = In(
        "float64[3]", unit="m/s^2", default=(math.nan,) * 3, doc="acceleration without gravity; NaN: missing"
    )
    place = In("float64[3]", unit="m", default=(math.nan,) * 3, doc="x, y, h; NaN: missing")
    motion = In("float64[3]", unit="m/s", default=(math.nan,) * 3, doc="its rate of change; NaN: missing")
    is_armed = State("bool")
    asked = State(unit="s")  # when it was asked to be otherwise; below 0: it is as asked
    due = Work("bool")

    example = """
        turn:
          block: sources.table
          rate: fast
          with:
            times: {value: [0, 0.5, 1], unit: s}
            values: {value: [[0, 0, 0], [5, 3, 0], [0, 0, 0]], unit: deg}
        rates: {block: signal.derivative, rate: fast, in: {u: turn.y}}
        autopilot:
          block: mavlink.simulated_autopilot
          rate: fast
          in: {attitude: turn.y, body_rates: rates.rate}
    """

    def start(self) -> None:
        """Begin disarmed."""
        self.asked = -1.0

    def output(
        self, attitude: Any, body_rates: Any, force: Any, place: Any, motion: Any, arm: bool, time: float
    ) -> Any:
        """Return what an autopilot would say."""
        waits = arm != self.is_armed
        since = time if self.asked < 0.0 else self.asked
        self.due = waits and reached(time, since + self.delay)
        measures = all_finite(force)
        gyro = copied(body_rates) if measures else np.full(3, math.nan)
        return (
            True,
            attitude[0],
            attitude[1],
            attitude[2],
            copied(body_rates),
            0.0 if measures else math.nan,
            gyro,
            copied(force),
            0.0 if all_finite(place) else math.nan,
            copied(place),
            copied(motion),
            0.0,
            self.mode_number,
            self.is_armed,
            ARM if waits else (DONE if arm else IDLE),
            math.nan,
            1,
            0,
            0,
            0,
            0,
            0,
            0.0,
            0,
            0,
        )

    def update(self, arm: bool, time: float) -> None:
        """Keep since when it is asked, and arm or disarm when it is time."""
        if self.due:
            self.is_armed = arm
        if arm == self.is_armed:
            self.asked = -1.0
        elif self.asked < 0.0:
            self.asked = time
