"""What the stand-ins for drivers have in common: channels, failures, and a record of all writes.

The writes of all processes go into the file CARD_LOG, a line each: instant (ns), what, channel, value.
CARD_REFUSES names a file with a number in each line: channels (from 0) that refuse.
"""

from __future__ import annotations

import os
import time
from pathlib import Path

values: dict[tuple[str, int], float] = {}  # what inputs give
opened: list[str] = []
asked: list[tuple[int, ...]] = []  # how inputs were read


def wrote(what: str, channel: int, value: float) -> None:
    """Record a write."""
    line = f"{time.monotonic_ns()} {what} {channel} {value:.9g}\n".encode()
    descriptor = os.open(os.environ["CARD_LOG"], os.O_WRONLY | os.O_APPEND | os.O_CREAT)
    os.write(descriptor, line)
    os.close(descriptor)


def refuses(channel: int) -> bool:
    """Return whether a channel refuses."""
    path = Path(os.environ.get("CARD_REFUSES", "/dev/null"))
    return str(channel) in path.read_text().split() if path.exists() else False


def writes(path: Path) -> list[tuple[int, str, int, float]]:
    """Return all writes: instant (ns), what, channel, value."""
    found = []
    for line in path.read_text().splitlines() if path.exists() else []:
        instant, what, channel, value = line.split()
        found.append((int(instant), what, int(channel), float(value)))
    return found
