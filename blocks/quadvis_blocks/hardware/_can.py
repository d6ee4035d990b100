"""Ports that are CAN buses, by python-can: ``can:socketcan:can0``, ``can:pcan:PCAN_USBBUS1``.

A piece of bytes here is a frame: its identifier in four bytes, little-endian, the highest bit set if it has
29 bits, then its data. Linux marks identifiers in the same way (``<linux/can.h>``).
"""

from __future__ import annotations

import errno
import logging
import re
from collections.abc import Iterable
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from typing import Any

from quadvis.block import Card, OpenPort, PortError
from quadvis.errors import quoted, sentence
from quadvis.errors.words import on_one_line
from quadvis.machine.ports import Waiting
from quadvis_blocks.hardware._protocol.description import FrameId

PORT = re.compile(r"can:(?P<interface>[a-z_0-9]+):(?P<channel>.+)")
EXAMPLE = "can:socketcan:can0"
EXTENDED = 1 << 31
HEAD = 4  # bytes of the identifier
MOST = 1000  # frames at one reading: a flood must not hold up a loop
GONE = (errno.ENETDOWN, errno.ENODEV, errno.ENXIO, errno.EBADF)


def piece_of(frame: FrameId, data: bytes) -> bytes:
    """Return a frame as a piece of bytes."""
    return (frame.number | EXTENDED * frame.extended).to_bytes(HEAD, "little") + data


@dataclass(frozen=True)
class CanBus(Card):
    """Settings of a CAN bus: ``bitrate`` (1/s), where the adapter needs it, and the frame that is sent there.

    Without one, the bus is read. Several devices may have one bus, each with another frame to send.
    """

    bitrate: int
    sent: FrameId | None = None

    def open(self, port: str) -> OpenPort:
        """Open the bus; PortError in one sentence if that cannot be."""
        match, missing = PORT.fullmatch(port), self.missing(port)
        if match is None or missing:
            raise PortError(missing or f"{quoted(port)} is no CAN bus; write such as {EXAMPLE}")
        logging.getLogger("can").addHandler(logging.NullHandler())  # the errors come as exceptions, too
        can: Any = import_module("can")
        try:
            bus = can.Bus(interface=match["interface"], channel=match["channel"], bitrate=self.bitrate)
        except Exception as error:
            reason = on_one_line(str(error)) or type(error).__name__
            raise PortError(f"CAN bus {quoted(port)} cannot be opened: {reason}") from error
        return OpenBus(can, bus)

    def missing(self, port: str) -> str:
        """Return a sentence if python-can is missing."""
        problem = f"port {quoted(port)} needs the package python-can"
        return "" if find_spec("can") is not None else sentence(problem, "install quadvis[can]")

    def claims(self, port: str) -> Iterable[object]:
        """Return the frame that is sent there."""
        return [] if self.sent is None else [(port, self.sent)]


class OpenBus(OpenPort):
    """A CAN bus that is open."""

    def __init__(self, can: Any, bus: Any) -> None:
        self._can, self._bus = can, bus

    def write(self, piece: bytes) -> int:
        """Send a frame; 0 if the adapter has no room for it now."""
        head = int.from_bytes(piece[:HEAD], "little")
        frame = self._can.Message(
            arbitration_id=head & ~EXTENDED, is_extended_id=bool(head & EXTENDED), data=piece[HEAD:]
        )
        try:
            self._bus.send(frame, timeout=0.0)
        except Exception as error:
            if getattr(error, "error_code", None) in GONE or not isinstance(error, self._can.CanError):
                raise PortError(f"the CAN bus is gone: {on_one_line(str(error))}") from error
            return 0
        return len(piece)

    def read_waiting(self) -> Waiting:
        """Return the frames that have come; one that reports an error of the bus is empty."""
        found: list[bytes] = []
        while len(found) < MOST:
            try:
                frame = self._bus.recv(timeout=0.0)
            except Exception as error:
                raise PortError(f"the CAN bus is gone: {on_one_line(str(error))}") from error
            if frame is None:
                break
            if frame.is_error_frame:
                found.append(b"")
            elif not frame.is_remote_frame:
                identifier = FrameId(frame.arbitration_id, frame.is_extended_id)
                found.append(piece_of(identifier, bytes(frame.data)))
        return Waiting(tuple(found), late=len(found) >= MOST)

    def close(self) -> None:
        """Release the bus."""
        self._bus.shutdown()
