"""The one rule for comparing times, the same interpreted and compiled.

The time of a tick is exact, but an instant that was computed from decimal numbers is rounded: 0.1 + 0.2 is
later than 0.3. An exact comparison would miss the tick of such an instant. So two instants (s) that are no
further apart than `INSTANT` count as equal. The same rule holds for durations.
"""

from __future__ import annotations

from typing import Any

INSTANT = 1e-9  # s; far below any period, far above the rounding of a run of years


def reached(time: Any, instant: Any) -> Any:
    """Return whether a time is at an instant or after it, or whether a duration is at least as long."""
    return time >= instant - INSTANT


def passed(time: Any, instant: Any) -> Any:
    """Return whether a time is after an instant, or whether a duration is longer."""
    return time > instant + INSTANT
