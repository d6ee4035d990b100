"""The whole packets in bytes that come in pieces of any length, whatever stands between them.

After damage the search goes on one byte later, so a damaged packet costs no other one. A packet whose
checksum is right for another byte of definition is whole, and its number is unknown, or its definition is
another one than ours: these are counted by number, and are no damage. One such packet in 256 damaged ones
would be by chance; so they count from the second one with the same byte on, and not if their sender has sent
good ones.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from typing import NamedTuple, Protocol

from quadvis_blocks.mavlink._dialect import MessageDefinition
from quadvis_blocks.mavlink._packets import (
    CHECK,
    HEAD,
    LEAST,
    MAGIC,
    MAGIC_1,
    SIGNATURE,
    SIGNED,
    checksum,
    implied_extra,
)

NUMBERS = 256  # of sequence numbers
SUSPECTS = 1000  # kinds of packets at most that have come once and are not known
HEARTBEAT_1 = bytes([MAGIC_1, 9])  # how a heartbeat of MAVLink 1 begins
HEARTBEAT_1_LENGTH, HEARTBEAT_EXTRA = 17, 50

Sender = tuple[int, int]  # system and component


class Packet(NamedTuple):
    """A whole packet; ``missing`` is how many of its sender are not there between the last one and this."""

    number: int
    sender: Sender
    payload: bytes
    missing: int


class Proof(Protocol):
    """What looks at signatures."""

    def refusal(self, packet: bytes, sender: Sender) -> str:
        """Return "" if a whole packet is signed as it must be, else in a word why it is not."""


class PacketCounts:
    """What has come besides good packets.

    ``damaged`` counts stretches of bytes that are no packet, ``unknown`` and ``differs`` whole messages by
    number, ``rejected`` packets by the word of the proof, ``version_1`` heartbeats of MAVLink 1.
    """

    def __init__(self) -> None:
        self.damaged = self.version_1 = 0
        self.unknown: Counter[int] = Counter()
        self.differs: Counter[int] = Counter()
        self.rejected: Counter[str] = Counter()


class PacketScanner:
    """Takes packets off bytes; ``proof`` says which of them count, if any need not."""

    def __init__(self, definitions: Mapping[int, MessageDefinition], proof: Proof | None = None) -> None:
        self._definitions, self._proof = definitions, proof
        self.counts = PacketCounts()
        self._in_damage = False
        self._sequences: dict[Sender, int] = {}
        self._good: set[tuple[Sender, int]] = set()
        self._suspects: Counter[tuple[Sender, int, int]] = Counter()

    def take(self, received: bytearray) -> Iterator[Packet]:
        """Take all whole packets off the beginning, with what is before them; leave what may be one."""
        at = done = 0
        waiting = -1  # where a packet may have begun that has not come whole
        while (at := received.find(MAGIC, at)) >= 0:
            end = at + _length(received, at)
            if end > len(received):
                waiting = at if waiting < 0 else waiting
                if self._is_opaque(received, at):
                    break
                at += 1
                continue
            found = self._whole(bytes(received[at:end]), bytes(received[end : end + 1])) if end > at else None
            if found is None:
                at += 1
                continue
            self._damage(received[done:at])
            at, done, waiting, self._in_damage = end, end, -1, False
            if isinstance(found, Packet):
                yield found
        rest = len(received) if waiting < 0 else waiting
        self._damage(received[done:rest])
        del received[:rest]

    def _whole(self, data: bytes, after: bytes) -> Packet | bool | None:
        """Return a packet; True if it is whole and does not count; None if it is damaged."""
        _, length, _, _, sequence, system, component, low, high = HEAD.unpack_from(data)
        sender, number = (system, component), low | high << 16
        inside = HEAD.size + length
        extra = implied_extra(data[1:inside], CHECK.unpack_from(data, inside)[0])
        if extra is None:
            return None
        definition = self._definitions.get(number)
        if definition is None or extra != definition.extra:
            return self._odd(sender, number, extra, after)
        if self._proof is not None and (why := self._proof.refusal(data, sender)):
            self.counts.rejected[why] += 1
            return True
        self._good.add((sender, number))
        self.counts.damaged += self.counts.differs.pop(number, 0)
        missing = (sequence - self._sequences.get(sender, sequence - 1) - 1) % NUMBERS
        self._sequences[sender] = sequence
        return Packet(number, sender, data[HEAD.size : inside], missing)

    def _odd(self, sender: Sender, number: int, extra: int, after: bytes) -> bool | None:
        """Count a packet that fits another definition; None if it must be a damaged one."""
        if (after and after[0] not in (MAGIC, MAGIC_1)) or (sender, number) in self._good:
            return None
        if len(self._suspects) >= SUSPECTS:
            self._suspects = Counter({each: count for each, count in self._suspects.items() if count > 1})
        suspect = sender, number, extra
        self._suspects[suspect] += 1
        if (count := self._suspects[suspect]) > 1:
            kind = self.counts.differs if number in self._definitions else self.counts.unknown
            kind[number] += 1 + (count == 2)
        return True

    def _damage(self, piece: bytes | bytearray) -> None:
        """Count bytes that are no packet, with those before them once."""
        if not piece:
            return
        self.counts.damaged += not self._in_damage
        self._in_damage = True
        at = piece.find(HEARTBEAT_1)
        heartbeat = bytes(piece[at : at + HEARTBEAT_1_LENGTH]) if at >= 0 else b""
        if len(heartbeat) == HEARTBEAT_1_LENGTH:
            check = CHECK.unpack(heartbeat[-2:])[0]
            self.counts.version_1 += checksum(heartbeat[1:-2] + bytes([HEARTBEAT_EXTRA])) == check

    def _is_opaque(self, received: bytearray, at: int) -> bool:
        """Return whether the packet that begins here may have packets inside that are not meant for us."""
        if len(received) < at + HEAD.size:
            return False
        low, high = HEAD.unpack_from(received, at)[-2:]
        definition = self._definitions.get(low | high << 16)
        return definition is not None and definition.is_opaque


def _length(received: bytearray, at: int) -> int:
    """Return how long the packet is that begins here; 0 if none does."""
    if len(received) < at + 3:
        return LEAST
    length, flags = received[at + 1], received[at + 2]
    if flags & ~SIGNED:
        return 0
    return LEAST + length + (SIGNATURE if flags & SIGNED else 0)
