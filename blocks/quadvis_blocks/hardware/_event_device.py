"""A device of Linux that gives events (/dev/input/event*), read without any library.

A read gives whole ``struct input_event``; a report ends with SYN_REPORT. The package evdev does the same, but
is compiled where it is installed, for which a machine that flies has no compiler; what is needed of it is one
structure and five calls. See <linux/input.h> and the kernel's Documentation/input/event-codes.rst.

A FIFO that carries such events may stand in the place of a device. It answers no call, so its axes go from
-32767 to 32767, hats from -1 to 1, and nothing is known of it before its first report.
"""

from __future__ import annotations

import errno
import os
import stat
import struct
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any, NamedTuple

from quadvis.errors import quoted
from quadvis.machine.files import reason
from quadvis.machine.ports import PortError
from quadvis_blocks.hardware._event_codes import (
    EV_ABS,
    EV_KEY,
    EV_SYN,
    HATS,
    MOST_ABS,
    MOST_KEY,
    SYN_DROPPED,
    SYN_REPORT,
    EventCode,
)

EVENT = struct.Struct("llHHi")  # struct input_event: seconds, microseconds, type, code, value
ABSINFO = struct.Struct("6i")  # struct input_absinfo: value, minimum, maximum, ...
AT_ONCE = 64  # events at one reading
NANOSECONDS, MICROSECOND = 10**9, 1000
STAND_IN, HAT = (-32767, 32767), (-1, 1)

Ioctl = Callable[[int, int, Any], Any]


def _read_call(number: int, size: int) -> int:
    return 2 << 30 | size << 16 | ord("E") << 8 | number


GET_KEYS = _read_call(0x18, (MOST_KEY + 8) // 8)
GET_KEYS_THERE = _read_call(0x20 + EV_KEY, (MOST_KEY + 8) // 8)
GET_AXES_THERE = _read_call(0x20 + EV_ABS, (MOST_ABS + 8) // 8)
GET_AXIS = _read_call(0x40, ABSINFO.size)  # and the code of the axis
SET_CLOCK = 1 << 30 | 4 << 16 | ord("E") << 8 | 0xA0


class Lacking(PortError):
    """A device that has not what is asked of it, so that waiting does not help."""


class EventReport(NamedTuple):
    """The state after a report: its instant (ns, monotonic), and the shares (0 to 1) of the codes' ranges."""

    instant: int
    shares: tuple[float, ...]
    dropped: bool  # whether events before it were lost


class EventDevice:
    """An open device, of which only ``codes`` count; PortError if it is gone, `Lacking` if it has not all."""

    def __init__(self, path: str, codes: Sequence[EventCode], ioctl: Ioctl | None = None) -> None:
        self._path, self._codes = path, tuple(codes)
        self._ioctl = ioctl or _system_ioctl()
        try:
            self.descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        except OSError as error:
            raise PortError(f"joystick {quoted(path)} cannot be opened: {reason(error)}") from error
        self._rest, self._dropped = b"", False
        self._values: dict[EventCode, int | None] = dict.fromkeys(self._codes)
        try:
            self.stands_in = ioctl is None and stat.S_ISFIFO(os.fstat(self.descriptor).st_mode)
            self._ranges = {code: self._range(code) for code in self._codes}
            self.clocked = not self.stands_in and self._take_clock()
            if not self.stands_in:
                self._ask_state()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close it."""
        os.close(self.descriptor)

    def state(self, instant: int) -> EventReport:
        """Return the state as it is known now."""
        dropped, self._dropped = self._dropped, False
        return EventReport(instant, tuple(self._share(code) for code in self._codes), dropped)

    def read(self) -> Iterator[EventReport]:
        """Yield the reports that have come; PortError if the device is gone."""
        try:
            piece = os.read(self.descriptor, AT_ONCE * EVENT.size)
        except BlockingIOError:
            return
        except OSError as error:
            raise _gone(self._path, error) from error
        if not piece:
            raise _gone(self._path)
        now = time.monotonic_ns()
        whole = self._rest + piece
        end = len(whole) - len(whole) % EVENT.size
        self._rest = whole[end:]
        for seconds, microseconds, kind, code, value in EVENT.iter_unpack(whole[:end]):
            if kind == EV_SYN and code == SYN_DROPPED:
                self._dropped = True
            elif kind == EV_SYN and code == SYN_REPORT:
                if self._dropped and not self.stands_in:
                    self._ask_state()
                stamp = seconds * NANOSECONDS + microseconds * MICROSECOND
                yield self.state(min(stamp, now) if self.clocked else now)
            elif not self._dropped and EventCode(kind, code) in self._values:
                self._values[EventCode(kind, code)] = value

    def _share(self, code: EventCode) -> float:
        low, high = self._ranges[code]
        value = self._values[code]
        if value is None:
            return 0.0 if code.kind == EV_KEY else 0.5
        return min(max((value - low) / (high - low), 0.0), 1.0)

    def known(self, code: EventCode) -> bool:
        """Return whether anything is known of an axis or a button."""
        return self._values[code] is not None

    def _range(self, code: EventCode) -> tuple[int, int]:
        if self.stands_in:
            return (0, 1) if code.kind == EV_KEY else HAT if code.code in HATS else STAND_IN
        there = self._there(code.kind)
        if code.code not in there:
            names = ", ".join(str(EventCode(code.kind, other)) for other in there) or "none"
            what = "button" if code.kind == EV_KEY else "axis"
            raise Lacking(f"joystick {quoted(self._path)} has no {what} {code}; it has {names}")
        if code.kind == EV_KEY:
            return 0, 1
        _, low, high, *_ = self._axis(code)
        if low >= high:
            raise Lacking(
                f"joystick {quoted(self._path)} gives no range for its axis {code}; take another one"
            )
        return low, high

    def _there(self, kind: int) -> list[int]:
        call, most = (GET_KEYS_THERE, MOST_KEY) if kind == EV_KEY else (GET_AXES_THERE, MOST_ABS)
        bits = self._call(call, bytes((most + 8) // 8))
        return [code for code in range(most + 1) if bits[code // 8] >> code % 8 & 1]

    def _ask_state(self) -> None:
        keys = self._call(GET_KEYS, bytes((MOST_KEY + 8) // 8))
        for code in self._codes:
            pressed = keys[code.code // 8] >> code.code % 8 & 1
            self._values[code] = pressed if code.kind == EV_KEY else self._axis(code)[0]

    def _axis(self, code: EventCode) -> tuple[int, ...]:
        return ABSINFO.unpack(self._call(GET_AXIS + code.code, bytes(ABSINFO.size)))

    def _take_clock(self) -> bool:
        """Ask for stamps by the monotonic clock; return whether they are."""
        with suppress(OSError):
            self._ioctl(self.descriptor, SET_CLOCK, struct.pack("i", time.CLOCK_MONOTONIC))
            return True
        return False

    def _call(self, number: int, room: bytes) -> bytes:
        try:
            return bytes(self._ioctl(self.descriptor, number, room))
        except OSError as error:
            if error.errno == errno.ENODEV:
                raise _gone(self._path, error) from error
            raise Lacking(f"{quoted(self._path)} is no event device: {reason(error)}") from error


def _gone(path: str, error: OSError | None = None) -> PortError:
    return PortError(
        f"joystick {quoted(path)} is gone: {reason(error) if error else 'it has been unplugged'}"
    )


def _system_ioctl() -> Ioctl:
    if sys.platform != "linux":
        raise Lacking("joysticks are read on Linux only")
    import fcntl

    return fcntl.ioctl
