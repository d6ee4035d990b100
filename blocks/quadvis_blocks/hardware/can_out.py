"""Commands as frames on a CAN bus that a file describes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from quadvis.block import Declared, Output, Param, PortSettings, Sealer
from quadvis_blocks.hardware._can import HEAD, piece_of
from quadvis_blocks.hardware._can_device import CanFrame, described_frame
from quadvis_blocks.hardware._protocol.counting import MessageCounter
from quadvis_blocks.hardware._protocol.encode import encode
from quadvis_blocks.hardware._sent_message import SentMessage, sent_ports


class CanOut(SentMessage, CanFrame, Output):
    """Commands on a CAN bus, by python-can (extra ``can``), with the fields of a protocol's file.

    Each value of the frame is an input, with an initial and a safe value: ``initial`` and ``safe``, or
    ``initial_NAME`` and ``safe_NAME`` if there are several. What goes beyond the range of a value stays at
    its end. A counter in the frame goes on with each frame that is sent, the safe ones too.
    """

    rate = "spacing"

    spacing = Param(20e-3, unit="s", min=1e-3, max=1.0, doc="from one frame to the next")

    example = """
        angle: {block: sources.sine, rate: fast, with: {amplitude: 10 deg, frequency: 1 Hz}}
        actuator:
          block: hardware.can_out
          rate: fast
          with:
            port: can:socketcan:can0
            protocol: "quadvis:protocols/lab_can.yaml"
            message: actuator
            safe_position: 0 deg
            safe_current: 0 A
            initial_position: 0 deg
            initial_current: 0 A
          in: {position: angle.y, current: 2 A}
    """

    @classmethod
    def ports(cls, protocol: str, message: str) -> dict[str, Declared]:
        """Return an input for each value of the frame, with its two values, and what is sent of it."""
        return sent_ports(cls, described_frame(protocol, message).message.values)

    @property
    def settings(self) -> PortSettings:
        """The settings of the bus."""
        return self.bus(self.frame_id)

    def frame(self, *inputs: Any) -> bytes:
        """Return the frame of some commands."""
        return piece_of(self.frame_id, encode(self.described.message, inputs))

    def sealer(self) -> Sealer | None:
        """Return what numbers the frames, if they have a number."""
        message = self.described.message
        return _FrameCounter(MessageCounter(message)) if message.modulus else None


@dataclass
class _FrameCounter:
    """Numbers the data of frames."""

    counter: MessageCounter
    added: int = 0

    def seal(self, frame: bytes, now_ns: int) -> bytes:
        """Return a frame with the next number."""
        return frame[:HEAD] + self.counter.seal(frame[HEAD:], now_ns)
