"""What all devices of a MAVLink port have in common: the port, the dialect, and as whom they speak."""

from __future__ import annotations

from quadvis.block import Line, LineDevice, Param, ParameterError
from quadvis_blocks.mavlink._dialect import MessageDefinition, dialect
from quadvis_blocks.mavlink._keys import NAME
from quadvis_blocks.mavlink._packets import LooseMessage, loosened
from quadvis_blocks.mavlink._sealer import PacketSealer

KINDS = {"companion": 18, "ground_station": 6}  # MAV_TYPE
SYSTEMS = 255
FOLDER_DOC = "`NAME.key` in the folder `mavlink` of the home of keys"


class Station(LineDevice):
    """A device at a port of MAVLink 2, which it may share with others of the same name.

    All blocks at a port speak as one ``own_component`` of one ``own_system``; 1 and 191 are a computer on
    board of system 1. They have one row of sequence numbers, one heartbeat a second, and one signature.
    """

    shared = "mavlink"
    port_example = "udp:127.0.0.1:14550"
    line = Line("baud")

    port = Param(
        type="port", doc="serial port, or udp:HOST:PORT; with udp::PORT the first who speaks is answered"
    )
    baud = Param(921_600, type="int64", min=1200, max=10**7, doc="speed of a serial line (1/s)")
    dialect = Param("common", type="str", doc="name of the messages' definitions; ardupilotmega has more")
    own_system = Param(1, type="int64", min=1, max=SYSTEMS, doc="number of the system as which it speaks")
    own_component = Param(191, type="int64", min=1, max=SYSTEMS, doc="number of its component")
    role = Param("companion", choices=tuple(KINDS), doc="what its heartbeats say that it is")
    key = Param(
        "", type="str", doc=f"name of the key that signs, {FOLDER_DOC}; without one nothing is signed"
    )
    signing_link = Param(0, type="int64", min=0, max=255, doc="number of this link in signatures")

    def check(self) -> None:
        """Refuse a dialect that there is not, and a name that no key can have."""
        dialect(self.dialect)
        if self.key and not NAME.fullmatch(self.key):
            raise ParameterError("key", f"key must be the name of a key, got '{self.key}'")

    def sealer(self) -> PacketSealer:
        """Return what makes packets of messages."""
        kind = list(KINDS.values())[self.role]
        return PacketSealer(self.own_system, self.own_component, kind, self.key, self.signing_link)

    def definition(self, name: str) -> MessageDefinition:
        """Return what the dialect says of a message; ParameterError if it has none of this name."""
        found = dialect(self.dialect).names.get(name)
        if found is None:
            raise ParameterError("dialect", f"dialect '{self.dialect}' has no message {name}")
        return found

    def loose(self, name: str, **fields: object) -> LooseMessage:
        """Return a message of the dialect; ParameterError if the dialect has none of this name."""
        definition = self.definition(name)
        return LooseMessage(definition.number, definition.extra, definition.pack(**fields))

    def framed(self, name: str, **fields: object) -> bytes:
        """Return a message as the frame that goes to the guardian."""
        return loosened([self.loose(name, **fields)])
