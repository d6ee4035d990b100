"""Makes packets of messages when they are sent, in the process that owns the port."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from quadvis_blocks.mavlink._keys import KeptTimes, read_key
from quadvis_blocks.mavlink._packets import SIGNED, LooseMessage, loose_messages, packet
from quadvis_blocks.mavlink._signing import Clock, Signer

SECOND = 10**9  # ns from one heartbeat to the next
SEQUENCES = 256
ADDED = 54  # bytes at most that a packet has more than a loose message, with its signature and a heartbeat
HEARTBEAT, HEARTBEAT_EXTRA = 0, 50
INVALID, ACTIVE, VERSION = 8, 4, 3  # no autopilot; active; of the protocol


@dataclass
class PacketSealer:
    """Gives packets their numbers and signatures, and sends a heartbeat once a second.

    It speaks as ``component`` of ``system``, and is a MAV_TYPE ``kind``. ``key`` is the name of the key with
    which it signs packets of the ``link``; "" if it does not.
    """

    system: int
    component: int
    kind: int
    key: str = ""
    link: int = 0
    clock: Clock = time.time_ns
    added: int = ADDED
    _sequence: int = field(default=0, compare=False)
    _beaten: int | None = field(default=None, compare=False)  # the instant of the last heartbeat
    _signer: Signer | None = field(default=None, compare=False)

    def seal(self, frame: bytes, now_ns: int) -> bytes:
        """Return the packets of loose messages, and a heartbeat if due; QuadvisError without the key."""
        sealed = [self._packet(message) for message in loose_messages(frame)]
        if self._beaten is None or now_ns - self._beaten >= SECOND:
            self._beaten = now_ns
            sealed.append(self._packet(self._heartbeat()))
        return b"".join(sealed)

    def _heartbeat(self) -> LooseMessage:
        return LooseMessage(
            HEARTBEAT, HEARTBEAT_EXTRA, bytes([0, 0, 0, 0, self.kind, INVALID, 0, ACTIVE, VERSION])
        )

    def _packet(self, message: LooseMessage) -> bytes:
        if self.key and self._signer is None:
            self._signer = Signer(
                read_key(self.key), self.link, KeptTimes(self.key, signs=True, clock=self.clock), self.clock
            )
        flags = SIGNED if self._signer is not None else 0
        made = packet(message, self._sequence, self.system, self.component, flags)
        self._sequence = (self._sequence + 1) % SEQUENCES
        return made + self._signer.signature(made) if self._signer is not None else made
