"""The datagrams of Betaflight's software in the loop (SITL): the state of the craft in, pulses of motors out.

What the firmware takes was found by experiment with version 4.6.0 (`tests/diagrams/test_betaflight.py`), and
agrees with its ``src/platform/SIMULATOR/sitl.c``:

- Angular rates about forward, right and down axis: roll > 0 right side down, pitch > 0 nose up, yaw > 0
  clockwise from above.
- The attitude is the quaternion (w, x, y, z) of the same axes, which turns vectors of the craft into those of
  the world north, east, down. The firmware takes it as it is: its own filter of gyro and accelerometer does
  not run. A quaternion of axes with z up reverses pitch, and the craft turns over at take-off.
- The acceleration is minus the specific force along forward, left and up axis: (0, 0, -g) at rest.
- The time in a packet scales the firmware's clock: by the packet's step in time over the time between two
  packets, each measured once, so late packets make it jump. Packets that all have one time leave the clock
  alone. So they have time 0 here.

The firmware has no lockstep of its own: its loop sleeps and looks at the machine's clock, and its control
laws take their period as given, whether it is kept or not. So that clock is ours, see ``_lockstep.c``: a
state lets it go on by one step, and when the loop has used that up, a packet of one byte comes.
"""

from __future__ import annotations

import math
import socket
import struct
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Any

from quadvis.errors import sentence
from quadvis.machine.files import reason
from quadvis_blocks.firmware._connection import FirmwareError

HERE = "127.0.0.1"
STATE = struct.Struct("<18d")  # time, rates, acceleration, attitude, velocity, position, pressure
PULSES = struct.Struct("<H2x16f")  # number of motors, their pulses (us), further ones
SEA_LEVEL = 101325.0  # Pa
LEAST_PULSE, SPAN = 1000.0, 1000.0  # us
MOTORS = 4
DONE = 1  # bytes of the packet that ends a step
LARGEST = 1 << 12  # bytes
LOOKS = 300  # of some microseconds each
SILENT, LOOK = 5.0, 0.05  # s


def state_packet(attitude: Any, rates: Any, specific_force: Any) -> bytes:
    """Return the packet of a state: roll, pitch, yaw (rad), rates (rad/s), force (m/s^2), all (3,)."""
    forward, right, down = (float(part) for part in specific_force)
    return STATE.pack(
        0.0,
        *(float(rate) for rate in rates),
        -forward, right, down,
        *quaternion(*(float(angle) for angle in attitude)),
        0.0, 0.0, 0.0,
        0.0, 0.0, 0.0,
        SEA_LEVEL,
    )  # fmt: skip


def quaternion(roll: float, pitch: float, yaw: float) -> tuple[float, float, float, float]:
    """Return the quaternion (w, x, y, z) of 3-2-1 angles, from the craft's axes to north, east, down."""
    cr, sr = math.cos(0.5 * roll), math.sin(0.5 * roll)
    cp, sp = math.cos(0.5 * pitch), math.sin(0.5 * pitch)
    cy, sy = math.cos(0.5 * yaw), math.sin(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


def motor_commands(packet: bytes) -> tuple[float, ...] | None:
    """Return the commands of four motors, 0 at 1000 us to 1 at 2000 us; None if the packet is none."""
    if len(packet) < PULSES.size:
        return None
    pulses = PULSES.unpack_from(packet)[1 : 1 + MOTORS]
    if not all(math.isfinite(pulse) for pulse in pulses):
        return None
    return tuple(min(max((pulse - LEAST_PULSE) / SPAN, 0.0), 1.0) for pulse in pulses)


class Exchange:
    """The sockets for both, step by step; FirmwareError if somebody has the address already."""

    def __init__(self, pulses: int, state: int) -> None:
        self._state = (HERE, state)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((HERE, pulses))
        except OSError as error:
            self._socket.close()
            raise taken("UDP", pulses, error) from error

    def send(self, packet: bytes) -> None:
        """Send a state, which begins a step."""
        self._socket.sendto(packet, self._state)

    def motors(self, lives: Callable[[], bool]) -> tuple[float, ...] | None:
        """Wait for the end of the step; return the last commands in it, None if there were none.

        FirmwareError if it does not come, or cannot come since the firmware no longer ``lives``.
        """
        found = None
        while len(packet := self._packet(lives)) > DONE:
            found = motor_commands(packet) or found
        return found

    def close(self) -> None:
        """Give the address back."""
        self._socket.close()

    def _packet(self, lives: Callable[[], bool]) -> bytes:
        """Return the next packet. It comes soon: whoever sleeps on a busy machine wakes up late."""
        self._socket.settimeout(0.0)
        for _ in range(LOOKS):
            with suppress(BlockingIOError):
                return self._socket.recv(LARGEST)
        self._socket.settimeout(LOOK)
        end = time.monotonic() + SILENT
        while time.monotonic() < end and lives():
            with suppress(TimeoutError):
                return self._socket.recv(LARGEST)
        raise FirmwareError(f"it has not ended its step within {SILENT:g} s")


def check_free(udp: int, tcp: int) -> None:
    """Raise FirmwareError if somebody has the ports at which the firmware will listen."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as trial:
        try:
            trial.bind(("", udp))
        except OSError as error:
            raise taken("UDP", udp, error) from error
    try:
        socket.create_connection((HERE, tcp), 1.0).close()
    except OSError:
        return
    raise taken("TCP", tcp)


def taken(kind: str, port: int, error: OSError | None = None) -> FirmwareError:
    """Return the error of a port that somebody has."""
    why = f" ({reason(error)})" if error is not None else ""
    problem = f"{kind} port {port} of this machine is not free{why}"
    return FirmwareError(sentence(problem, "end the other simulated flight controller first"))
