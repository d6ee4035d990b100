"""Frames on a CAN bus that a file describes: the newest one at each step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from quadvis.block import Counted, Input, Out, PortSettings
from quadvis_blocks.hardware._can import HEAD, piece_of
from quadvis_blocks.hardware._can_device import CanFrame, described_frame
from quadvis_blocks.hardware._message_device import received_ports
from quadvis_blocks.hardware._protocol.decode import Decoded, decoding
from quadvis_blocks.hardware._protocol.finder import Gap


class CanIn(CanFrame, Input):
    """Frames on a CAN bus, by python-can (extra ``can``), with the fields of a protocol's file.

    Each value of the frame is an output. A frame of the right identifier whose length, fixed bytes, checksum
    or values are not those of the file is refused. Frames of error that the adapter reports are refused,
    too: they say how well the bus is. Needs python-can, which knows SocketCAN, PCAN, Kvaser, Vector and more.
    """

    besides = ("others",)

    others = Out("int64", doc="frames with other identifiers")

    example = """
        engine:
          block: hardware.can_in
          rate: fast
          with: {port: can:socketcan:can0, protocol: "quadvis:protocols/lab_can.yaml", message: engine}
    """

    @classmethod
    def ports(cls, protocol: str, message: str) -> dict[str, Out]:
        """Return an output for each value of the frame."""
        return received_ports(cls, described_frame(protocol, message).message.values)

    @property
    def settings(self) -> PortSettings:
        """The settings of the bus."""
        return self.bus(None)

    def open(self) -> None:
        """Open the bus; no frame has come."""
        super().open()
        message = self.described.message
        self._head = piece_of(self.frame_id, b"")
        self._decoding, self._gap = decoding(message), Gap(message.modulus)

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take one frame."""
        frame = bytes(received)
        received.clear()
        if frame and frame[:HEAD] != self._head:
            yield Counted.OTHER
            return
        found = self._decoding(frame[HEAD:]) if frame else None
        if isinstance(found, Decoded):
            yield from [Counted.LOST] * self._gap.before(found.counter)
            yield found.values
        else:
            yield Counted.REFUSED

    def beside(self) -> tuple[Any, ...]:
        """Return how many frames had other identifiers."""
        return (self._counts[Counted.OTHER],)
