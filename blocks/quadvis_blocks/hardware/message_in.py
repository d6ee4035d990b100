"""Messages of a protocol that a file, or a format, describes: the newest one at each step."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from quadvis.block import Counted, Input, Line, Out, Param, ParameterError
from quadvis.machine.ports import PortSettings
from quadvis_blocks.hardware._message_device import (
    DescribedLine,
    chosen,
    doubt_about,
    received_ports,
)
from quadvis_blocks.hardware._protocol.finder import Finder
from quadvis_blocks.hardware._protocol.formats import WrittenMessage


class MessageIn(DescribedLine, Input):
    """Messages of other people's devices, over a serial line or as datagrams: lines of text, or bytes.

    A file describes the protocol (see blocks/README.md), or a format in the diagram, as xPC Target's blocks
    for RS-232 and Unpack have it. Each value of the message is an output. A message that is not whole, whose
    checksum is wrong, or that has a value beyond its range, gives nothing and is counted; the search goes on
    inside of it. Of several messages that have come, the newest counts.

    What the protocol says under ``initialise`` is sent once, as soon as the device has had the time to start,
    and what it says under ``terminate`` at the end of the run; a message's ``request`` at each step.
    """

    line = Line("baud")
    besides = ("others", "starting")

    port = Param(type="port", doc="serial port, udp:HOST:PORT, or a cable such as pty:imu")
    others = Out("int64", doc="whole messages of other kinds")
    starting = Out("bool", doc="the device has not had the time to start: what comes does not count")

    example = """
        imu:
          block: hardware.message_in
          rate: fast
          with: {port: pty:imu, protocol: "quadvis:protocols/lab_imu.yaml"}
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
    ) -> dict[str, Out]:
        """Return an output for each value of the message."""
        written = WrittenMessage(format, names, units, ranges, header, terminator, checksum)
        return received_ports(cls, chosen(protocol, message, written).message.values)

    @property
    def settings(self) -> PortSettings:
        """The settings of the port."""
        return self.port_settings(super().settings)

    def check(self) -> None:
        """Refuse a message that could not be found in a stream of bytes."""
        message = self.described.message
        if not message.is_marked and not self.port_given.startswith("udp:"):
            problem = f"message '{message.name}' cannot be found in a stream of bytes"
            remedy = "it needs a header, a terminator, a checksum, or fixed bytes"
            raise ParameterError(self.described_by, f"{problem}; {remedy}")

    def doubts(self) -> list[ParameterError]:
        """Return the warning that damaged messages may be believed."""
        has_own = self.port_given.startswith("udp:")  # a datagram has a checksum, and so has its cable
        return [] if has_own else doubt_about(self.described.message, self.described_by)

    def open(self) -> None:
        """Open the port; no message has come."""
        super().open()
        told, message = self.described
        others = [other for other in told.messages.values() if other is not message]
        self._finder, self._request = Finder(message, others), message.request
        self._to_send, self._at_end = b"".join(told.initialise), b"".join(told.terminate)

    def read(self, time: float) -> None:
        """Take all messages that have come, and send what the device waits for."""
        super().read(time)
        if not self.is_starting:
            self._to_send += self._request if not self._to_send else b""
            self._to_send = self._to_send[self.send(self._to_send) :]

    def decode(self, received: bytearray) -> Iterator[Any]:
        """Take the whole messages."""
        yield from self._finder.take(received, is_whole=self._port.whole)

    def beside(self) -> tuple[Any, ...]:
        """Return how many messages of other kinds have come, and whether the device starts."""
        return self._counts[Counted.OTHER], self.is_starting

    def close(self) -> None:
        """Send what ends the device's messages, and close the port."""
        if "_at_end" in self.__dict__:
            self.send(self.__dict__.pop("_at_end"))
        super().close()
