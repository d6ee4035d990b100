"""What the blocks hardware.can_in and can_out share: the bus, and the frame that a file describes."""

from __future__ import annotations

from functools import cached_property

from quadvis.block import Param, ParameterError
from quadvis.errors import sentence
from quadvis.machine.inputs import read_once
from quadvis_blocks.hardware._can import EXAMPLE, PORT, CanBus
from quadvis_blocks.hardware._message_device import BlockMessage, Chosen, named
from quadvis_blocks.hardware._protocol.description import DeviceProtocol, FrameId
from quadvis_blocks.hardware._protocol.reading import read_protocol


class CanFrame(BlockMessage):
    """A base class beside that of the device."""

    port = Param(type="port", doc=f"bus by python-can, can:INTERFACE:CHANNEL, such as {EXAMPLE}")
    protocol = Param(type="file", doc="file that describes the frames (YAML)")
    message = Param("", type="str", doc="name of the frame; none if the protocol has one only")
    bitrate = Param(
        500_000, type="int64", min=10_000, max=10**6, doc="of the bus (1/s), where the adapter has to be told"
    )

    @cached_property
    def described(self) -> Chosen:
        """The frame, and the protocol that it belongs to."""
        return frame_of(self.read_file("protocol", read_protocol), str(self.message))

    @property
    def frame_id(self) -> FrameId:
        """The identifier of the frame."""
        found = self.described.message.frame_id
        assert found is not None
        return found

    def bus(self, sent: FrameId | None) -> CanBus:
        """Return the settings of the bus; ParameterError if the port is none."""
        if PORT.fullmatch(str(self.port)) is None:
            raise ParameterError("port", f"port must be a CAN bus, such as {EXAMPLE}, got '{self.port}'")
        return CanBus(int(self.bitrate), sent)


def frame_of(protocol: DeviceProtocol, name: str) -> Chosen:
    """Return the frame of a name; ParameterError if there is none, or if it has no identifier."""
    found = named(protocol, name)
    if found.message.frame_id is None:
        problem = f"message '{found.message.name}' has no id, so it is no frame on a CAN bus"
        raise ParameterError("message", sentence(problem, "add such as 'id: 0x123' to it in the protocol"))
    return found


def described_frame(protocol: str, message: str) -> Chosen:
    """Return the frame that the parameters of a block describe."""
    return frame_of(read_once(read_protocol, protocol), message)
