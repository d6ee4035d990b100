"""Signatures of MAVLink 2: 13 bytes with a link, a time and 48 bits of SHA-256 over key, packet and these.

The time counts 10 us since 2015. It rises from packet to packet and never falls behind the clock, nor after a
restart behind what was sent before: receivers refuse what is older. See
https://mavlink.io/en/guide/message_signing.html.
"""

from __future__ import annotations

import hashlib
import hmac
import time
from collections.abc import Callable
from typing import Protocol

from quadvis_blocks.mavlink._packets import SIGNATURE, SIGNED

EPOCH = 1_420_070_400 * 10**9  # ns, of 1 January 2015
UNIT = 10_000  # ns
MINUTE = 60 * 10**9 // UNIT
PROVEN = 6  # bytes of the hash
FLAGS = 2  # where the flags are in a packet

NONE, WRONG, OLD = "unsigned", "wrong signature", "old signature"  # why a packet is refused

Clock = Callable[[], int]  # ns since 1970


class SigningTimes(Protocol):
    """What must outlive a run: the time of the last packet sent, and those heard of each stream."""

    sent: int
    heard: int

    def of(self, stream: int) -> int | None:
        """Return the last time heard of a stream; None if it is a new one."""

    def set(self, stream: int, stamp: int) -> bool:
        """Keep the last time of a stream; return False if there is no room for another one."""


def signing_time(clock: Clock = time.time_ns) -> int:
    """Return the time of signatures by a clock."""
    return max(0, clock() - EPOCH) // UNIT


class Signer:
    """Signs packets of one link; ``times`` are kept from run to run."""

    def __init__(self, key: bytes, link: int, times: SigningTimes, clock: Clock = time.time_ns) -> None:
        self._key, self._link, self._times, self._clock = key, link, times, clock

    def signature(self, packet: bytes) -> bytes:
        """Return the signature of a packet that has the flag of signed ones."""
        times = self._times
        stamp = max(signing_time(self._clock), times.sent + 1, times.heard + 1)
        times.sent = stamp
        tail = bytes([self._link]) + stamp.to_bytes(6, "little")
        return tail + hashlib.sha256(self._key + packet + tail).digest()[:PROVEN]


class SignatureCheck:
    """Lets those packets count that are signed with a key, each once and in their order."""

    def __init__(self, key: bytes, times: SigningTimes, clock: Clock = time.time_ns) -> None:
        self._key, self._times, self._clock = key, times, clock

    def refusal(self, packet: bytes, sender: tuple[int, int]) -> str:
        """Return "" if a packet counts, else in a word why it does not."""
        if not packet[FLAGS] & SIGNED:
            return NONE
        proof = hashlib.sha256(self._key + packet[:-PROVEN]).digest()[:PROVEN]
        if not hmac.compare_digest(proof, packet[-PROVEN:]):
            return WRONG
        times = self._times
        stamp = int.from_bytes(packet[1 - SIGNATURE : -PROVEN], "little")
        stream = packet[-SIGNATURE] << 16 | sender[0] << 8 | sender[1]
        last = times.of(stream)
        oldest = last if last is not None else max(signing_time(self._clock), times.heard) - MINUTE
        if stamp <= oldest or not times.set(stream, stamp):
            return OLD
        times.heard = max(times.heard, stamp)
        return ""
