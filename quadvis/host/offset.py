"""How far the monotonic clock of a target is from that of this host."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import NamedTuple

PINGS = 12


class Offset(NamedTuple):
    """The target's clock minus ours (ns), and how far that may be wrong: half of the shortest round trip."""

    offset: int
    error: int


def measure(
    ask: Callable[[], int], pings: int = PINGS, clock: Callable[[], int] = time.monotonic_ns
) -> Offset:
    """Return the offset of a clock that ``ask`` reads (ns).

    Of all round trips the shortest one counts, as in Cristian's algorithm (Distributed Computing 3, 1989):
    the other clock was read between our two readings.
    """
    best: Offset | None = None
    for _ in range(pings):
        before = clock()
        theirs = ask()
        after = clock()
        found = Offset(theirs - (before + after) // 2, (after - before + 1) // 2)
        if best is None or found.error < best.error:
            best = found
    assert best is not None, "at least one ping"
    return best
