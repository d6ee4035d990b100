"""How long a block that keeps what is on its way can delay it."""

from __future__ import annotations

from quadvis.block import ParameterError, passed


def check_delay(delay: float, ticks: int, period: float) -> None:
    """Refuse a ``delay`` (s) of more than so many ticks of a period (s); ParameterError."""
    longest = ticks * period
    if passed(delay, longest):
        bound = f"at most {ticks} ticks of the block, {longest:g} s"
        raise ParameterError("delay", f"delay must be {bound}, got {delay:g} s; give the block a slower rate")
