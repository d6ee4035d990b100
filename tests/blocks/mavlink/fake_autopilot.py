"""An autopilot made of pymavlink's own tools, by which ours are tested: streams, parameters, arming.

It does what it is told to do wrong: forget the rates that were asked for, ignore requests, stay silent,
answer with any time-outs.
"""

from __future__ import annotations

import os
import select
import threading
import time
from collections.abc import Callable
from typing import Any

os.environ.setdefault("MAVLINK20", "1")
os.environ.setdefault("MAVLINK_DIALECT", "common")

from pymavlink import mavutil
from pymavlink.dialects.v20 import common

from tests.quadvis.realtime.ptys import arrive

PX4, ARDUPILOT = common.MAV_AUTOPILOT_PX4, common.MAV_AUTOPILOT_ARDUPILOTMEGA
ATTITUDE, IMU, POSITION = 30, 105, 32
GOOD = {
    PX4: {"COM_OF_LOSS_T": 1.0, "COM_RC_LOSS_T": 0.5},
    ARDUPILOT: {"GUID_TIMEOUT": 1.0, "RC_OVERRIDE_TIME": 1.0},
}


class MavPty(mavutil.mavfile):  # type: ignore[misc]
    """mavutil over one end of a pty; ``port`` is the other one, if who reads there must not wait."""

    def __init__(self, descriptor: int, system: int, component: int, port: int = -1) -> None:
        self._port = port
        os.set_blocking(descriptor, False)
        mavutil.mavfile.__init__(self, descriptor, "pty", source_system=system, source_component=component)

    def recv(self, n: int | None = None) -> bytes:
        try:
            return os.read(self.fd, 1 << 16)
        except BlockingIOError:
            return b""

    def write(self, data: bytes) -> None:
        if self._port >= 0:
            arrive(self.fd, self._port, data)
        else:
            os.write(self.fd, data)

    def close(self) -> None:
        """Leave the pty to its owner."""


def over_udp(port: int, system: int = 1, component: int = 1) -> Any:
    """Return mavutil's connection that listens at a port."""
    mavutil.set_dialect("common")
    return mavutil.mavlink_connection(
        f"udpin:127.0.0.1:{port}", source_system=system, source_component=component, dialect="common"
    )


class FakeAutopilot:
    """Answers over ``link``; ``heard`` are all messages with their times, in their order.

    ``default_rate`` (Hz) is that of an attitude nobody has asked for. It obeys a request for a rate for
    ``obeys`` seconds.
    """

    def __init__(
        self,
        link: Any,
        firmware: int = PX4,
        parameters: dict[str, float] | None = None,
        *,
        default_rate: float = 4.0,
        obeys: float = float("inf"),
        arms: bool = True,
    ) -> None:
        self.link, self.mav, self.firmware = link, link.mav, firmware
        self.parameters = dict(GOOD[firmware] if parameters is None else parameters)
        self.default_rate, self.obeys, self.arms = default_rate, obeys, arms
        self.rates: dict[int, tuple[float, float]] = {}  # with the times at which they were asked for
        self._sent: dict[int, float] = {}
        self._beat = -1.0
        self.armed, self.mode, self.is_silent = False, 0, False
        self.heard: list[tuple[float, Any]] = []
        self.pose = (0.1, -0.2, 0.3)

    def pump(self, now: float) -> None:
        """Do all that is due at a time (s)."""
        while (message := self.link.recv_msg()) is not None:
            self.heard.append((now, message))
            self._answer(message, now)
        if self.is_silent:
            return
        if now >= self._beat + 1.0:
            self._beat = now
            base = common.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | (
                common.MAV_MODE_FLAG_SAFETY_ARMED if self.armed else 0
            )
            self.mav.heartbeat_send(common.MAV_TYPE_QUADROTOR, self.firmware, base, self.mode, 4)
        self._stream(ATTITUDE, now, lambda at: self.mav.attitude_send(at, *self.pose, 0.01, 0.02, 0.03))
        self._stream(IMU, now, self._send_imu)
        self._stream(
            POSITION, now, lambda at: self.mav.local_position_ned_send(at, 1.0, 2.0, -3.0, 0.1, 0.2, -0.3)
        )

    def _send_imu(self, at: int) -> None:
        self.mav.highres_imu_send(
            1000 * at, 0.5, -0.25, -9.75, 0.01, 0.02, 0.03, 0, 0, 0, 1013.0, 0, 0, 20.0, 0xFFFF
        )

    def _stream(self, number: int, now: float, send: Callable[[int], None]) -> None:
        rate, asked = self.rates.get(number, (0.0, 0.0))
        if not rate or now - asked >= self.obeys:
            rate = self.default_rate if number == ATTITUDE else 0.0
        last = self._sent.get(number, -1e9)
        if rate and now - last >= 1.0 / rate - 1e-9:
            self._sent[number] = now
            send(int(1000 * now))

    def _answer(self, message: Any, now: float) -> None:
        kind = message.get_type()
        if kind == "COMMAND_LONG" and message.target_system == self.mav.srcSystem:
            self._obey(message, now)
        elif kind == "PARAM_REQUEST_READ" and message.param_id in self.parameters:
            value = self.parameters[message.param_id]
            self.mav.param_value_send(message.param_id.encode(), value, common.MAV_PARAM_TYPE_REAL32, 1, 0)

    def _obey(self, message: Any, now: float) -> None:
        result = common.MAV_RESULT_ACCEPTED
        if message.command == common.MAV_CMD_SET_MESSAGE_INTERVAL:
            if self.obeys > 0:
                self.rates[int(message.param1)] = (1e6 / message.param2, now)
        elif message.command == common.MAV_CMD_COMPONENT_ARM_DISARM:
            if self.arms:
                self.armed = bool(message.param1)
                self._beat = -1.0
            else:
                result = common.MAV_RESULT_DENIED
                self.mav.statustext_send(2, b"PreArm: Check firmware")
        elif message.command == common.MAV_CMD_DO_SET_MODE:
            px4 = int(message.param2) << 16 | int(message.param3) << 24
            self.mode = px4 if self.firmware == PX4 else int(message.param2)
            self._beat = -1.0
        self.mav.command_ack_send(message.command, result)

    def of(self, kind: str) -> list[tuple[float, Any]]:
        """Return the messages of a kind that were heard, with their times."""
        return [(at, each) for at, each in self.heard if each.get_type() == kind]


class Running:
    """A fake autopilot that lives in a thread, on the monotonic clock."""

    def __init__(self, fake: FakeAutopilot) -> None:
        self.fake = fake
        self._ends = threading.Event()
        self._thread = threading.Thread(target=self._live, daemon=True)

    def __enter__(self) -> FakeAutopilot:
        self._thread.start()
        return self.fake

    def __exit__(self, *_: object) -> None:
        self._ends.set()
        self._thread.join()
        self.fake.link.close()

    def _live(self) -> None:
        while not self._ends.is_set():
            select.select([self.fake.link.fd], [], [], 0.002)
            self.fake.pump(time.monotonic())
