"""What a bad line does to messages."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Counted
from quadvis_blocks.hardware._protocol.description import DeviceProtocol, ProtocolMessage
from quadvis_blocks.hardware._protocol.finder import Finder

SHARE = 0.01  # of the bytes with a wrong bit


def flipped(data: bytes, random: np.random.Generator, share: float = SHARE) -> bytes:
    """Return bytes of which some have one wrong bit each."""
    found = np.frombuffer(data, np.uint8).copy()
    hit = np.flatnonzero(random.random(len(found)) < share)
    found[hit] ^= (1 << random.integers(0, 8, len(hit))).astype(np.uint8)
    return found.tobytes()


def finder(message: ProtocolMessage, protocol: DeviceProtocol | None = None) -> Finder:
    """Return the finder of a message among those of its protocol."""
    others = [] if protocol is None else [each for each in protocol.messages.values() if each is not message]
    return Finder(message, others)


def taken(search: Finder, data: bytes, piece: int = 997, kept: list[int] | None = None) -> list[Any]:
    """Return what is found in bytes that come in pieces; ``kept`` gets the counts of bytes that wait."""
    received, found = bytearray(), []
    for begin in range(0, len(data), piece):
        received += data[begin : begin + piece]
        found += list(search.take(received))
        if kept is not None:
            kept.append(len(received))
    return found


def split(found: list[Any]) -> tuple[list[Any], dict[Counted, int]]:
    """Return values and counts apart."""
    values = [each for each in found if not isinstance(each, Counted)]
    return values, {kind: found.count(kind) for kind in Counted}
