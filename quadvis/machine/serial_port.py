"""Serial ports of Linux: their line settings, opened for one program alone, read and written without waiting.

A port is locked both ways before its line is touched: by ``flock``, which careful programs look at, and by
TIOCEXCL, by which the system refuses everybody but root. pyserial opens a port by itself and sets its line in
the same step, so it cannot keep that order; it finds the ports that there are.
"""

from __future__ import annotations

import errno
import os
import struct
from collections.abc import Iterable
from contextlib import suppress
from typing import NamedTuple

from quadvis.errors import quoted, sentence
from quadvis.errors.words import on_one_line
from quadvis.machine.files import file_key, reason
from quadvis.machine.ports import OpenPort, PortError, Waiting

PARITIES = ("none", "even", "odd")
MOST = 1 << 16  # bytes at one reading: a flood must not hold up a loop
BACKLOG = 4095  # bytes that the system keeps for a reader; what comes after these may have been lost
CLOSEST = 0.03  # of the baud rate that was asked for; farther off no receiver follows

# <asm-generic/termbits.h>: any baud rate, not only the old ones that Python's module termios has.
TCGETS2, TCSETS2 = 0x802C542A, 0x402C542B
TERMIOS2 = struct.Struct("4IB19B2I")
BOTHER, ANY_BAUD, INPUT_BAUD = 0o10000, 0o10017, 16
TIOCNXCL = 0x540D
# <linux/serial.h>: struct serial_struct, in 32-bit words.
SERIAL_STRUCT, FLAGS, ASYNC_LOW_LATENCY = struct.Struct("18i"), 4, 1 << 13
NAMED = 4  # ports at most in a message


class Line(NamedTuple):
    """The settings of a serial line: ``baud`` (1/s), and ``bits``, ``parity`` and ``stop_bits`` of a byte.

    ``baud`` may be the name of the parameter of a block that gives it. ``gap`` is the silence (s) that a
    receiver needs after a frame. The lines DTR and RTS are low, which does not restart a board, unless
    ``dtr`` or ``rts`` is true.
    """

    baud: int | str
    bits: int = 8
    parity: str = "none"
    stop_bits: int = 1
    gap: float = 0.0
    dtr: bool = False
    rts: bool = False

    @property
    def bits_of_byte(self) -> int:
        """The bits of a byte on the line, with its start, parity and stop bits."""
        return 1 + self.bits + (self.parity != "none") + self.stop_bits

    def time(self, count: int) -> float:
        """Return how long so many bytes take (s)."""
        return count * self.bits_of_byte / int(self.baud)

    def open(self, port: str) -> OpenPort:
        """Open, lock and set up a port; PortError in one sentence if that cannot be."""
        return OpenLine(open_port(port, self))

    def missing(self, port: str) -> str:
        """Return a sentence if there is no port of this path, else ""."""
        return missing_port(port)

    def claims(self, port: str) -> Iterable[object]:
        """Return the identity of the port, which may have several names."""
        return [file_key(port)]

    def __str__(self) -> str:
        """Return the usual text, such as "100000 baud 8E2"."""
        baud = f"'{self.baud}'" if isinstance(self.baud, str) else self.baud
        return f"{baud} baud {self.bits}{self.parity[0].upper()}{self.stop_bits}"


class OpenLine(OpenPort):
    """An open serial port."""

    whole = False

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor

    def fileno(self) -> int:
        """Return its descriptor."""
        return self._descriptor

    def write(self, piece: bytes) -> int:
        """Write as many bytes as there is room for; return their number."""
        return write_some(self._descriptor, piece)

    def unsent(self) -> int:
        """Return how many bytes still wait in the system for the line."""
        return unsent(self._descriptor)

    def read_waiting(self) -> Waiting:
        """Return the bytes that have come, in one piece."""
        found = read_waiting(self._descriptor)
        return Waiting((found,), late=len(found) >= BACKLOG)

    def close(self) -> None:
        """Let others open the port again, and close it."""
        close_port(self._descriptor)


class LentLine(OpenLine):
    """A serial port that another process has opened, and keeps."""

    def close(self) -> None:
        """Give the descriptor back; the port stays that of the other process."""
        with suppress(OSError):
            os.close(self._descriptor)


def open_port(path: str, line: Line) -> int:
    """Open, lock and set up a port; return its descriptor. PortError in one sentence if that cannot be.

    The driver is asked to hand bytes on at once; `has_low_latency` says whether it does.
    """
    import termios

    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK | os.O_CLOEXEC)
    except OSError as error:
        raise _refused(path, error) from error
    try:
        _lock(descriptor, path)
        set_line(descriptor, line)
        _ask_low_latency(descriptor)
        termios.tcflush(descriptor, termios.TCIFLUSH)  # what came before is old
        _check_baud(descriptor, line, path)
    except BaseException:
        os.close(descriptor)
        raise
    return descriptor


def missing_port(path: str) -> str:
    """Return a sentence if there is no port of this path, else ""."""
    return "" if os.path.exists(path) else str(_refused(path, OSError(errno.ENOENT, "")))


def close_port(descriptor: int) -> None:
    """Let others open the port again, and close it."""
    import fcntl

    with suppress(OSError):
        fcntl.ioctl(descriptor, TIOCNXCL)
    with suppress(OSError):
        os.close(descriptor)


def set_line(descriptor: int, line: Line) -> None:
    """Set up a line for plain bytes; at its end nothing hangs up."""
    import fcntl
    import termios

    words = list(TERMIOS2.unpack(fcntl.ioctl(descriptor, TCGETS2, bytes(TERMIOS2.size))))
    size = {5: termios.CS5, 6: termios.CS6, 7: termios.CS7, 8: termios.CS8}[line.bits]
    flags = termios.CREAD | termios.CLOCAL | size | BOTHER | BOTHER << INPUT_BAUD
    flags |= {"none": 0, "even": termios.PARENB, "odd": termios.PARENB | termios.PARODD}[line.parity]
    flags |= termios.CSTOPB if line.stop_bits == 2 else 0
    words[:4] = [termios.INPCK | termios.IGNPAR | termios.IGNBRK, 0, flags, 0]
    words[5 + termios.VMIN], words[5 + termios.VTIME] = 1, 0  # so that no byte at all means: it is gone
    words[-2:] = [int(line.baud)] * 2
    fcntl.ioctl(descriptor, TCSETS2, TERMIOS2.pack(*words))
    for bit, high in ((termios.TIOCM_DTR, line.dtr), (termios.TIOCM_RTS, line.rts)):
        with suppress(OSError):  # a pty has no such lines
            fcntl.ioctl(descriptor, termios.TIOCMBIS if high else termios.TIOCMBIC, struct.pack("I", bit))


def has_low_latency(descriptor: int) -> bool:
    """Return whether the driver hands bytes on at once; False of a pty."""
    with suppress(OSError):
        return bool(_serial_struct(descriptor)[FLAGS] & ASYNC_LOW_LATENCY)
    return False


def read_waiting(descriptor: int) -> bytes:
    """Return the bytes that have come, at most some 64 KiB; PortError if the port is gone."""
    found = bytearray()
    while len(found) < MOST:
        try:
            piece = os.read(descriptor, MOST)
        except BlockingIOError:
            break
        except OSError as error:
            raise _gone(error) from error
        if not piece:
            raise _gone()
        found += piece
    return bytes(found)


def unsent(descriptor: int) -> int:
    """Return how many bytes still wait in the system for the line; PortError if the port is gone."""
    import fcntl
    import termios

    try:
        return int(struct.unpack("i", fcntl.ioctl(descriptor, termios.TIOCOUTQ, bytes(4)))[0])
    except OSError as error:
        raise _gone(error) from error


def write_some(descriptor: int, piece: bytes) -> int:
    """Write as many bytes as there is room for; return their number. PortError if the port is gone."""
    try:
        return os.write(descriptor, piece) if piece else 0
    except BlockingIOError:
        return 0
    except OSError as error:
        raise _gone(error) from error


def _lock(descriptor: int, path: str) -> None:
    import fcntl
    import termios

    if not os.isatty(descriptor):
        raise PortError(f"{quoted(path)} is no serial port; give the path of one")
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError as error:
        raise _taken(path) from error
    fcntl.ioctl(descriptor, termios.TIOCEXCL)


def _ask_low_latency(descriptor: int) -> None:
    import fcntl
    import termios

    with suppress(OSError):  # a driver that refuses
        words = _serial_struct(descriptor)
        words[FLAGS] |= ASYNC_LOW_LATENCY
        fcntl.ioctl(descriptor, termios.TIOCSSERIAL, SERIAL_STRUCT.pack(*words))


def _serial_struct(descriptor: int) -> list[int]:
    import fcntl
    import termios

    return [*SERIAL_STRUCT.unpack(fcntl.ioctl(descriptor, termios.TIOCGSERIAL, bytes(SERIAL_STRUCT.size)))]


def _check_baud(descriptor: int, line: Line, path: str) -> None:
    import fcntl

    given = TERMIOS2.unpack(fcntl.ioctl(descriptor, TCGETS2, bytes(TERMIOS2.size)))[-1]
    wanted = int(line.baud)
    if abs(given - wanted) > CLOSEST * wanted:
        raise PortError(f"port {quoted(path)} runs at {given} baud, not at {wanted}; use another adapter")


def _refused(path: str, error: OSError) -> PortError:
    named = f"port {quoted(path)}"
    if error.errno == errno.EBUSY:
        return _taken(path)
    if error.errno in (errno.ENOENT, errno.ENXIO, errno.ENODEV):
        remedy = f"plug the device in, or give the path of another port{_such_as()}"
        return PortError(sentence(f"{named} is missing", remedy))
    if error.errno in (errno.EACCES, errno.EPERM):
        remedy = "on Debian the group 'dialout' may: `sudo adduser $USER dialout`"
        return PortError(sentence(f"{named} must not be opened by this user", remedy))
    return PortError(f"{named} cannot be opened: {reason(error)}")


def _such_as() -> str:
    """Return words that name the ports of this computer, those on USB first; none if it has none."""
    from serial.tools.list_ports import comports

    try:
        ports = sorted(comports(), key=lambda port: (port.product is None, port.device))
    except (OSError, TypeError, ValueError):  # an adapter was unplugged while it was looked at
        return ""
    named = [
        quoted(port.device) + (f" ({on_one_line(port.product)})" if port.product else "")
        for port in ports[:NAMED]
    ]
    return f", such as {', '.join(named)}" if named else ""


def _gone(error: OSError | None = None) -> PortError:
    return PortError(f"the port is gone: {reason(error) if error else 'it has been unplugged'}")


def _taken(path: str) -> PortError:
    return PortError(f"port {quoted(path)} is in use by another program; end that one first")
