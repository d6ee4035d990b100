"""What a flight controller says of itself over MSP: attitude, rates, battery, state."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from quadvis.block import Counted, Input, Line, Out, Param, ParameterError, passed, reached
from quadvis.errors import sentence
from quadvis_blocks.hardware._msp import (
    ANALOG,
    ANSWER,
    ATTITUDE,
    RAW_IMU,
    REFUSAL,
    STATUS,
    V1,
    V2,
    MspMessage,
    encode,
    take,
)

DEGREE = math.pi / 180
PATIENCE = 0.1  # s after which an answer that has not come is lost, and the question is asked again
HALF_TURN = 1800  # tenths of a degree
ATTITUDES, IMU = struct.Struct("<3h"), struct.Struct("<6h")
ANALOGS, VOLTS, STATES = struct.Struct("<B2Hh"), struct.Struct("<H"), struct.Struct("<HHHI")
VERSIONS = ("v1", "v2")
# With 1 % of the bytes damaged, of a million attitudes; tests/blocks/hardware/test_msp_in.py counts it.
WRONG_V1 = 300


@dataclass
class _Question:
    """A request that is sent again and again; ``asked`` is when (s), NaN if nothing is awaited."""

    command: int
    every: float
    due: float = 0.0
    asked: float = math.nan


class MspIn(Input):
    """Attitude, rates, battery and state of a flight controller with Betaflight or iNav, over MSP.

    At each step the block asks for attitude and rates, and every ``status_every`` for battery and state. It
    asks again when the answer has come, or after 0.1 s: then the answer counts as lost. So no answers wait in
    the controller, and an attitude is as old as its way. In the controller's tab "Ports" choose MSP for the
    line; a UART gives about 100 attitudes a second at 115200 baud, USB more.

    Signs are those of this library: Betaflight's pitch and its rates of pitch and yaw have the other sign.
    Attitudes come in tenths of a degree, yaw and rates in whole degrees, which is coarse for a control law.
    With 1 % of the bytes damaged some 20 of a million attitudes would be wrong in spite of v2's checksum.
    An input may have the port of an ``hardware.msp_rc_out``, written alike.
    """

    line = Line("baud")
    besides = (
        "others", "unknown", "rates", "acceleration", "rates_age", "voltage", "current", "signal_strength",
        "armed", "modes", "status_age",
    )  # fmt: skip

    port = Param(type="port", doc="serial port, or a cable such as pty:controller")
    baud = Param(115_200, type="int64", min=9_600, max=4_000_000, doc="speed of the line (1/s)")
    version = Param("v2", choices=VERSIONS, doc="of MSP: v1 has a weaker checksum, for old firmware")
    one_g = Param(512.0, above=0.0, doc="what the controller counts for 9.80665 m/s^2; 512 or 256")
    status_every = Param(
        0.5, unit="s", min=0.05, max=10.0, doc="from one look at battery and state to the next"
    )
    others = Out("int64", doc="answers to other questions, and messages to others")
    unknown = Out("int64", doc="questions that the controller does not know")
    rates = Out("float64[3]", unit="rad/s", doc="of the gyro, about the axes of the craft")
    acceleration = Out(
        "float64[3]", unit="m/s^2", doc="of the accelerometer: forward, right, up; gravity is up"
    )
    rates_age = Out(unit="s", nan=True, doc="time since rates and acceleration came")
    voltage = Out(unit="V", doc="of the battery")
    current = Out(unit="A", doc="of the battery")
    signal_strength = Out(doc="of the radio, 0 to 1")
    armed = Out("bool", doc="the motors may turn")
    modes = Out(
        "int64", doc="the boxes that are active, a bit for each in the controller's order; bit 0: ARM"
    )
    status_age = Out(unit="s", nan=True, doc="time since battery and state came, the older of them")
    roll = Out(unit="rad", doc="right side down")
    pitch = Out(unit="rad", doc="nose up")
    yaw = Out(unit="rad", doc="clockwise from north, -pi to pi")

    example = """
        controller: {block: hardware.msp_in, rate: fast, with: {port: pty:controller}}
    """

    def doubts(self) -> list[ParameterError]:
        """Return the warning that version 1 lets damage through."""
        if self.version != VERSIONS.index("v1"):
            return []
        problem = (
            f"MSP v1 has an xor as its checksum: with 1 % of the bytes damaged, some {WRONG_V1} of a million "
            "attitudes would be wrong"
        )
        return [ParameterError("version", sentence(problem, "use v2 if the controller knows it"))]

    def open(self) -> None:
        """Open the port; nothing is known."""
        super().open()
        self._questions = {
            command: _Question(command, every)
            for command, every in (
                (ATTITUDE, 0.0),
                (RAW_IMU, 0.0),
                (ANALOG, self.status_every),
                (STATUS, self.status_every),
            )
        }
        self._now, self._unknown = 0.0, 0
        self._came = dict.fromkeys(self._questions, math.nan)
        self._rates, self._acceleration = np.zeros(3), np.zeros(3)
        self._battery, self._state = (0.0, 0.0, 0.0), (False, 0)

    def read(self, time: float) -> None:
        """Take all answers, and ask what is due."""
        self._now = time
        super().read(time)
        for question in self._questions.values():
            if passed(time, question.asked + PATIENCE):
                self._counts[Counted.LOST] += 1
                question.asked = math.nan
            if math.isnan(question.asked) and reached(time, question.due):
                request = encode(question.command, version=(V1, V2)[self.version])
                if self.send(request) == len(request):
                    question.asked, question.due = time, time + question.every

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take whole messages."""
        for message in take(received):
            if message is None:
                yield Counted.REFUSED
            elif message.command not in self._questions or message.direction not in (ANSWER, REFUSAL):
                yield Counted.OTHER
            else:
                self._questions[message.command].asked = math.nan
                yield from self._answer(message)

    def _answer(self, message: MspMessage) -> Iterator[Any]:
        if message.direction == REFUSAL:
            self._unknown += 1
            return
        read = {ATTITUDE: self._attitude, RAW_IMU: self._imu, ANALOG: self._analog, STATUS: self._status}
        try:
            found = read[message.command](message.payload)
        except struct.error:  # too short
            yield Counted.REFUSED
            return
        self._came[message.command] = self._now
        if found is not None:
            yield found

    def _attitude(self, payload: bytes) -> Any:
        roll, pitch, yaw = ATTITUDES.unpack_from(payload)
        if (
            abs(roll) > HALF_TURN
            or abs(pitch) > HALF_TURN // 2
            or not -HALF_TURN <= 10 * yaw <= 2 * HALF_TURN
        ):
            return Counted.REFUSED
        return roll * 0.1 * DEGREE, -pitch * 0.1 * DEGREE, math.remainder(yaw, 360) * DEGREE

    def _imu(self, payload: bytes) -> None:
        numbers = np.array(IMU.unpack_from(payload), float)
        self._acceleration = numbers[:3] * (9.80665 / self.one_g) * (1.0, -1.0, 1.0)
        self._rates = numbers[3:] * DEGREE * (1.0, -1.0, -1.0)

    def _analog(self, payload: bytes) -> None:
        tenths, _, strength, current = ANALOGS.unpack_from(payload)
        is_fine = len(payload) >= ANALOGS.size + VOLTS.size  # Betaflight 4.1 and later
        voltage = VOLTS.unpack_from(payload, ANALOGS.size)[0] * 0.01 if is_fine else tenths * 0.1
        self._battery = voltage, current * 0.01, min(strength / 1023, 1.0)

    def _status(self, payload: bytes) -> None:
        modes = STATES.unpack_from(payload)[3]
        self._state = bool(modes & 1), modes

    def beside(self) -> tuple[Any, ...]:
        """Return counts, rates, battery and state."""
        ages = {command: self._now - came for command, came in self._came.items()}
        return (
            self._counts[Counted.OTHER],
            self._unknown,
            self._rates,
            self._acceleration,
            ages[RAW_IMU],
            *self._battery,
            *self._state,
            np.maximum(ages[ANALOG], ages[STATUS]),
        )
