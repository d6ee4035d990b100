"""Clocks: the loop waits for one before each tick."""

from __future__ import annotations

from typing import Protocol


class Clock(Protocol):
    """Says when a tick may run. The loop asks before it runs a tick, and again where the answer ends."""

    def wait(self, tick: int, end: int) -> int:
        """Wait until ``tick`` may run; return the tick, at most ``end``, before which to ask again."""


class Unpaced:
    """The clock of a simulation: every tick may run at once."""

    def wait(self, tick: int, end: int) -> int:
        """Return ``end``."""
        return end
