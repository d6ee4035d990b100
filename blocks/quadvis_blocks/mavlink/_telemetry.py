"""What the messages of an autopilot say, in our units and axes; what cannot be true is no message."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from enum import Enum
from typing import Any, NamedTuple

import numpy as np

FASTEST = 100.0  # rad/s; no craft turns so fast
ANGLE = 2 * math.pi + 1e-3  # rad; the greatest angle that anybody sends
AHEAD = 10_000  # ms at most from one message to the next, if its clock was not restarted
OVERTAKEN = 1000  # ms: a message that is older than one before by less than this came late


class Attitude(NamedTuple):
    """Roll, pitch, yaw (rad) and rates (3,) (rad/s)."""

    roll: float = math.nan
    pitch: float = math.nan
    yaw: float = math.nan
    rates: Any = np.full(3, math.nan)


class Inertial(NamedTuple):
    """What gyro (3,) (rad/s) and accelerometer (3,) (m/s^2) measure: forward, right, down."""

    gyro: Any = np.full(3, math.nan)
    specific_force: Any = np.full(3, math.nan)


class LocalPosition(NamedTuple):
    """North, east and height (m), and their rates of change (m/s)."""

    position: Any = np.full(3, math.nan)
    velocity: Any = np.full(3, math.nan)


class FlightState(NamedTuple):
    """The autopilot's mode, and whether it is armed."""

    mode: int = 0
    armed: bool = False


ARMED = 0x80  # of base_mode


def attitude(fields: Mapping[str, Any]) -> Attitude | None:
    """Return what ATTITUDE says; None if it cannot be true."""
    angles = [fields[name] for name in ("roll", "pitch", "yaw")]
    rates = np.array([fields[name] for name in ("rollspeed", "pitchspeed", "yawspeed")])
    if not (np.abs(angles) <= ANGLE).all() or not (np.abs(rates) <= FASTEST).all():
        return None
    return Attitude(angles[0], angles[1], angles[2], rates)


def inertial(fields: Mapping[str, Any]) -> Inertial | None:
    """Return what HIGHRES_IMU says; None if it cannot be true."""
    gyro = np.array([fields[name] for name in ("xgyro", "ygyro", "zgyro")])
    force = np.array([fields[name] for name in ("xacc", "yacc", "zacc")])
    if not (np.abs(gyro) <= FASTEST).all() or not np.isfinite(force).all():
        return None
    return Inertial(gyro, force)


def local_position(fields: Mapping[str, Any]) -> LocalPosition | None:
    """Return what LOCAL_POSITION_NED says; None if it cannot be true."""
    position = np.array([fields["x"], fields["y"], -fields["z"]])
    velocity = np.array([fields["vx"], fields["vy"], -fields["vz"]])
    if not (np.isfinite(position).all() and np.isfinite(velocity).all()):
        return None
    return LocalPosition(position, velocity)


def flight_state(fields: Mapping[str, Any]) -> FlightState:
    """Return what HEARTBEAT says."""
    return FlightState(int(fields["custom_mode"]), bool(fields["base_mode"] & ARMED))


class MessageFate(Enum):
    """What becomes of a message."""

    TAKEN = "taken"
    LATE = "it was overtaken by a newer one"
    WRONG = "it cannot be true"


READERS: Mapping[str, Callable[[Mapping[str, Any]], Any]] = {
    "ATTITUDE": attitude,
    "HIGHRES_IMU": inertial,
    "LOCAL_POSITION_NED": local_position,
    "HEARTBEAT": flight_state,
}


KEPT_AS = {
    "ATTITUDE": "attitude",
    "HIGHRES_IMU": "inertial",
    "LOCAL_POSITION_NED": "local_position",
    "HEARTBEAT": "flight",
}


class Telemetry:
    """The newest of each message, and when it came (s)."""

    def __init__(self) -> None:
        self.attitude, self.inertial = Attitude(), Inertial()
        self.local_position, self.flight = LocalPosition(), FlightState()
        self._came = dict.fromkeys(READERS, math.nan)
        self._made: dict[str, int] = {}  # times since the autopilot's start (ms)
        self._odd: dict[str, int] = {}  # those that did not follow the last one

    def take(self, name: str, fields: Mapping[str, Any], time: float) -> MessageFate:
        """Take a message that came at a time (s)."""
        made = fields.get("time_boot_ms", fields.get("time_usec", 0) // 1000)
        last = self._made.get(name, made)
        if 0 < last - made < OVERTAKEN:
            return MessageFate.LATE
        found = READERS[name](fields)
        if found is None or not (0 <= made - last < AHEAD or self._confirms(name, made)):
            return MessageFate.WRONG
        setattr(self, KEPT_AS[name], found)
        self._came[name], self._made[name] = time, made
        return MessageFate.TAKEN

    def _confirms(self, name: str, made: int) -> bool:
        """Return whether a time that does not follow the last one follows one of its kind: a restarted clock.

        A checksum of 16 bits lets a few damaged messages through; one alone is not believed.
        """
        before, self._odd[name] = self._odd.get(name), made
        return before is not None and 0 <= made - before < AHEAD

    def age(self, name: str, time: float) -> float:
        """Return the time since a message came (s); NaN before the first one."""
        return time - self._came[name]
