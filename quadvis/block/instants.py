"""When an instant has come: the one rule for comparing times, interpreted and compiled.

The time of a tick is exact, but instants of decimal numbers are sums and differences of rounded ones: 0.1 +
0.2 is later than 0.3. Compared as they stand they would miss their tick, so two instants (s) no further apart
than `INSTANT` are one. The same holds for lengths of time.
"""

from __future__ import annotations

from typing import Any

INSTANT = 1e-9  # s; far below any period, far above the rounding of a run of years


def reached(time: Any, instant: Any) -> Any:
    """Return whether an instant has come by a time, or that a time has lasted that long."""
    return time >= instant - INSTANT


def passed(time: Any, instant: Any) -> Any:
    """Return whether a time is later than an instant, or longer than that."""
    return time > instant + INSTANT
