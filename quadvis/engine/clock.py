"""Clocks: the loop asks one which ticks may run, and when."""

from __future__ import annotations

from typing import Protocol


class Clock(Protocol):
    """Says which ticks may run. The loop asks before it runs a tick, and again where the answer ends."""

    def wait(self, tick: int, end: int) -> range:
        """Wait until a tick may run; return the ticks to run before asking again.

        They lie between ``tick``, the next one, and ``end``. Ticks before the first of them are left out.
        """


class Unpaced:
    """The clock of a simulation: every tick may run at once."""

    def wait(self, tick: int, end: int) -> range:
        """Return all ticks before ``end``."""
        return range(tick, end)
