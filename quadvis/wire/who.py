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

    @property
    def payer(self) -> bytes:
        """Who pays for a request: the key, or the connection of who has none."""
        return self.public or b"%d " % self.connection[0] + self.connection[1]
