"""The longest delay of a block with a queue of limited length."""

from __future__ import annotations

from quadvis.block import ParameterError, passed


def check_delay(delay: float, ticks: int, period: float) -> None:
    """Raise ParameterError if ``delay`` (s) is longer than ``ticks`` times ``period`` (s)."""
    longest = ticks * period
    if passed(delay, longest):
        bound = f"at most {ticks} ticks of the block, {longest:g} s"
        raise ParameterError("delay", f"delay must be {bound}, got {delay:g} s; give the block a slower rate")
