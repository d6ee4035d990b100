"""Commands as messages of a protocol that a file, or a format, describes."""

from __future__ import annotations

from typing import Any

from quadvis.block import Declared, Line, Output, Param, PortSettings, Sealer
from quadvis_blocks.hardware._message_device import DescribedLine, chosen
from quadvis_blocks.hardware._protocol.counting import MessageCounter
from quadvis_blocks.hardware._protocol.encode import encode
from quadvis_blocks.hardware._protocol.formats import WrittenMessage
from quadvis_blocks.hardware._sent_message import SentMessage, sent_ports


class MessageOut(SentMessage, DescribedLine, Output):
    """Commands to other people's devices, over a serial line or as datagrams: lines of text, or bytes.

    A file describes the protocol (see blocks/README.md), or a format in the diagram, as xPC Target's blocks
    for RS-232 and Pack have it. Each value of the message is an input, with an initial and a safe value:
    ``initial`` and ``safe``, or ``initial_NAME`` and ``safe_NAME`` if there are several. What goes beyond the
    range of a value stays at its end.

    What the protocol says under ``initialise`` is sent before the first message, and what it says under
    ``terminate`` after the last one: after the safe messages of the ``hold_time``, if that is not 0.
    """

    line = Line("baud")
    rate = "spacing"
    hold = "hold_time"

    port = Param(type="port", doc="serial port, udp:HOST:PORT, or a cable such as pty:servos")
    spacing = Param(20e-3, unit="s", min=1e-3, max=1.0, doc="from one message to the next")
    hold_time = Param(
        0.0,
        unit="s",
        min=0.0,
        max=60.0,
        doc="time of safe messages at the end, and nothing after it; 0: as long as anybody lives",
    )

    example = r"""
        angle: {block: sources.sine, rate: fast, with: {amplitude: 30 deg, frequency: 1 Hz}}
        servo:
          block: hardware.message_out
          rate: fast
          with:
            port: pty:servo
            baud: 115200
            format: "A%.2f"
            names: angle
            units: deg
            ranges: "-45..45"
            terminator: \n
            checksum: none
            initial: 0 deg
            safe: 0 deg
          in: {angle: angle.y}
    """

    @classmethod
    def ports(
        cls,
        protocol: str,
        message: str,
        format: str,
        names: str,
        units: str,
        ranges: str,
        header: str,
        terminator: str,
        checksum: str,
    ) -> dict[str, Declared]:
        """Return an input for each value of the message, with its two values, and what is sent of it."""
        written = WrittenMessage(format, names, units, ranges, header, terminator, checksum)
        values = chosen(protocol, message, written).message.values
        return sent_ports(cls, values)

    @property
    def settings(self) -> PortSettings:
        """The settings of the port."""
        return self.port_settings(super().settings)

    def frame(self, *inputs: Any) -> bytes:
        """Return the message of some commands."""
        return encode(self.described.message, inputs)

    def sealer(self) -> Sealer | None:
        """Return what numbers the messages, if they have a number."""
        message = self.described.message
        return MessageCounter(message) if message.modulus else None

    def beginning(self) -> bytes:
        """Return what is sent before the first message."""
        return b"".join(self.described.protocol.initialise)

    def ending(self) -> bytes:
        """Return what is sent after the last message."""
        return b"".join(self.described.protocol.terminate)
