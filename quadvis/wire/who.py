"""Who sent a message, as the transport has proved it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Who:
    """A host on one connection: its name, level and public key (b"" for this computer's own user).

    ``connection`` tells the connections of a target apart; no host can choose it.
    """

    name: str
    level: int
    public: bytes
    connection: tuple[int, bytes]
