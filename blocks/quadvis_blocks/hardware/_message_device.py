"""What the blocks hardware.message_... share: which message they mean, its ports and its line."""

from __future__ import annotations

import keyword
from collections.abc import Callable, Sequence
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, NamedTuple

from quadvis.block import Line, Out, Param, ParameterError, PortSettings
from quadvis.block.interface import RESERVED
from quadvis.errors import DiagramError, Fault, quoted, sentence, suggestion
from quadvis.machine.datagrams import Datagrams
from quadvis.machine.inputs import read_once
from quadvis_blocks.hardware._protocol.decode import Decoded, Decoding, decoding
from quadvis_blocks.hardware._protocol.description import (
    DeviceProtocol,
    NamedValue,
    ProtocolMessage,
)
from quadvis_blocks.hardware._protocol.encode import encode
from quadvis_blocks.hardware._protocol.formats import WrittenMessage, message_of
from quadvis_blocks.hardware._protocol.leaks import wrong_per_million
from quadvis_blocks.hardware._protocol.reading import read_protocol

if TYPE_CHECKING:
    from quadvis.block import Block as _Base
else:
    _Base = object  # a block has its base class from its device

Read = Callable[[], DeviceProtocol]
LEAKY = 1.0  # of a million messages that may give wrong values; a checksum of which more do is a doubt


class BlockMessage(_Base):
    """What the blocks that take or send a message have in common: a base class beside that of the device."""

    described: Any  # Chosen, from the block's parameters

    @cached_property
    def _decode(self) -> Decoding:
        return decoding(self.described.message)

    def on_wire(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """Return values as who receives their message has them."""
        found = self._decode(encode(self.described.message, values))
        assert isinstance(found, Decoded)
        return found.values


class DescribedMessage(BlockMessage):
    """Which message a block takes or sends, by a file or by a format."""

    protocol = Param("", type="file", doc="file that describes the protocol (YAML); or give a format")
    message = Param("", type="str", doc="name of the message; none if the protocol has one only")
    format = Param(
        "",
        type="str",
        doc="in place of a protocol: text as %f,%f of printf, or bytes as <3hB of Python's struct",
    )
    names = Param("", type="str", doc="names of the format's numbers, with blanks between them")
    units = Param("", type="str", doc="their units, or one for all; none for plain numbers")
    ranges = Param("", type="str", doc="their ranges, such as -180..180, or one for all")
    header = Param(
        "", type="str", doc="bytes by which each message of the format begins, such as $ or \\xAA\\x55"
    )
    terminator = Param("", type="str", doc="bytes by which it ends, such as \\r\\n")
    checksum = Param("", type="str", doc="checksum of the format, such as xor or crc16_modbus, or none")

    @cached_property
    def described(self) -> Chosen:
        """The message, and the protocol that it belongs to."""
        texts = self.format, self.names, self.units, self.ranges, self.header, self.terminator, self.checksum
        read = partial(self.read_file, "protocol", read_protocol)
        return chosen(str(self.protocol), str(self.message), WrittenMessage(*map(str, texts)), read)

    @property
    def described_by(self) -> str:
        """The name of the parameter that describes it."""
        return "protocol" if self.protocol else "format"


class DescribedLine(DescribedMessage):
    """The same of a device at a port, whose line the protocol may describe."""

    baud = Param(
        0, type="int64", min=0, max=10**7, doc="speed of a serial line (1/s); 0 is that of the protocol"
    )
    dtr = Param(
        False, type="bool", doc="the line DTR is high, which restarts some boards when the port is opened"
    )
    rts = Param(False, type="bool", doc="the line RTS is high")
    settle = Param(
        0.0,
        unit="s",
        min=0.0,
        max=60.0,
        doc="time that the device needs to start after the port was opened; 0 is that of the protocol",
    )

    def port_settings(self, found: PortSettings) -> PortSettings:
        """Return the settings of the port: those of the protocol, but for what the block itself says."""
        if not isinstance(found, Line):
            return found._replace(settle=float(self.settle)) if isinstance(found, Datagrams) else found
        told = self.described.protocol.line or Line(0)
        baud = int(self.baud) or int(told.baud)
        if not baud:
            remedy = "give it, or let the protocol's file say it: 'line: {baud: 115200}'"
            raise ParameterError("baud", sentence("baud is missing", remedy))
        return told._replace(
            baud=baud,
            dtr=bool(self.dtr) or told.dtr,
            rts=bool(self.rts) or told.rts,
            settle=float(self.settle) or told.settle,
        )


class Chosen(NamedTuple):
    """A message, and the protocol that it belongs to."""

    protocol: DeviceProtocol
    message: ProtocolMessage


def chosen(protocol: str, message: str, written: WrittenMessage, read: Read | None = None) -> Chosen:
    """Return the message that a block's parameters describe; ParameterError or DiagramError if they do not.

    ``read`` reads the file of a protocol.
    """
    if bool(protocol) == bool(written.format):
        problem = "a block has a protocol, which is a file, or a format, such as %f,%f or <3h"
        raise ParameterError("protocol" if protocol else "format", sentence(problem, "give one of the two"))
    if not protocol:
        made = message_of(written)
        return Chosen(DeviceProtocol(made.name, {made.name: made}), made)
    for name, value in written._asdict().items():
        if value:
            raise ParameterError(name, f"{name} goes with a format, and the protocol says it; leave it out")
    found = named(read() if read is not None else read_once(read_protocol, protocol), message)
    if found.message.frame_id is not None:
        problem = f"message '{found.message.name}' has an id, so it is a frame on a CAN bus"
        raise ParameterError("message", sentence(problem, "use hardware.can_in or hardware.can_out"))
    return found


def named(protocol: DeviceProtocol, name: str) -> Chosen:
    """Return the message of a name, or the only one; ParameterError if there is none."""
    if not name and len(protocol.messages) == 1:
        return Chosen(protocol, next(iter(protocol.messages.values())))
    if name not in protocol.messages:
        problem = f"there is no message '{name}' in the protocol" if name else "message is missing"
        raise ParameterError("message", sentence(problem, suggestion(name, protocol.messages)))
    return Chosen(protocol, protocol.messages[name])


def received_ports(kind: Any, values: Sequence[NamedValue]) -> dict[str, Out]:
    """Return an output for each value of a message that comes; ``kind`` is the class of the block."""
    check_names(values, kind, ())
    return {
        value.name: Out(
            value.type,
            unit=str(value.unit),
            nan=value.optional,
            doc=value.doc or f"'{value.name}' of the message",
        )
        for value in values
    }


def check_names(values: Sequence[NamedValue], taken: Any, made: Sequence[str]) -> None:
    """Refuse names of values that are something else in a block's class; ``made`` are those that follow.

    ``taken`` is the class.
    """
    if not values:
        raise ParameterError("message", "the message has no value; choose one that has")
    faults = []
    for value in values:
        names = [pattern.format(value.name) for pattern in ("{}", *made)]
        is_taken = any(hasattr(taken, name) for name in names) or value.name.startswith("_")
        if is_taken or keyword.iskeyword(value.name) or value.name in RESERVED:
            problem = f"{quoted(value.name)} has another meaning in a block"
            faults.append(Fault(value.place, "", problem, "choose another name"))
    if faults and not faults[0].place.file:
        raise ParameterError("names", sentence(faults[0].problem, faults[0].remedy))
    if faults:
        raise DiagramError(faults)


def doubt_about(message: ProtocolMessage, parameter: str) -> list[ParameterError]:
    """Return the warning that a checksum lets damaged messages through, if it does."""
    wrong = wrong_per_million(message)
    if wrong < LEAKY:
        return []
    kind = message.check.algorithm.name if message.check is not None else "no checksum"
    named = f"'{message.name}' has {kind if message.check is None else f'the checksum {kind}'}"
    problem = (
        f"message {named}: with 1 % of the bytes damaged, some {_round(wrong)} of a million messages "
        "would give wrong values"
    )
    remedy = "choose a CRC of 16 bits or more, such as crc16_ccitt_false, if the device can"
    return [ParameterError(parameter, sentence(problem, remedy))]


def _round(number: float) -> str:
    """Return a number with one digit that counts, or two above 10."""
    digits = 1 if number < 10 else 2
    return f"{float(f'{number:.{digits - 1}e}'):,.0f}"
