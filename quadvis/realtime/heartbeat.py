"""The heartbeat of a loop: how the guardian sees that it goes on, stops, or hangs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from quadvis.diagram.sections.overload import STOP, OverloadLimits
from quadvis.realtime import control
from quadvis.realtime.lifeline import Vigil
from quadvis.realtime.schedule import NANOSECONDS, Schedule


@dataclass(frozen=True)
class Patience:
    """How long a loop may give no sign of life in its ``words``; times are in nanoseconds.

    Its first tick is due ``first`` after the start. After a silence longer than ``allowed`` the loop hangs;
    if it is not ``lasting``, or in the time ``startup`` from the start on, it only pauses, and may go on.
    """

    name: str
    words: Any
    allowed: int
    first: int = 0
    startup: int = 0
    lasting: bool = True

    @staticmethod
    def of(name: str, words: Any, schedule: Schedule, limits: OverloadLimits) -> Patience:
        """Return the patience with a loop of these limits.

        It lasts for the ticks that may be missed in a row, and two.
        """
        all_limits = [limits, *(task.limits for task in limits.tasks)]
        stops = all(each.action == STOP for each in all_limits)
        missed = max(each.max if each.consecutive is None else each.consecutive for each in all_limits)
        first = schedule.deadline(min(rhythm.offset for rhythm in schedule.rhythms))
        longest = max(schedule.deadline(rhythm.every) for rhythm in schedule.rhythms)
        allowed = (2 + missed * stops) * schedule.interval
        startup = first + max(each.startup for each in all_limits) * longest
        return Patience(name, words, allowed, first, startup, stops)


class Sign(Enum):
    """What a look at a loop has found."""

    WELL = "well"
    PAUSES = "pauses"  # it gives no sign of life, which the diagram allows
    HANGS = "hangs"
    ENDS = "ends"  # or it goes on, and its outputs hold their safe values


class Heartbeat:
    """Looks at the words of a loop again and again; ``now`` gives the instant on the monotonic clock (ns)."""

    def __init__(self, patience: Patience, now: Callable[[], int]) -> None:
        self.patience, self._now = patience, now
        self._control = memoryview(patience.words).cast("B").cast("q")
        self._done, self._seen = 0, 0
        self._vigil: Vigil | None = None

    def hold_on(self, priority: int) -> None:
        """Take the lifeline of a loop that has started: its end is then seen in the moment of its death."""
        if self._vigil is None and self._control[control.START]:
            self._vigil = Vigil(self._control[control.LIFELINE], priority)

    def look(self) -> Sign:
        """Return what the loop does."""
        words, now = self._control, self._now()
        start, begun, done = words[control.START], words[control.BEGUN], words[control.DONE]
        if self._has_died or words[control.END] or words[control.SAFE] or words[control.LEFT]:
            return Sign.ENDS
        if not start:
            return Sign.WELL
        start += words[control.SHIFT]
        if done != self._done or not self._seen:
            self._done, self._seen = done, now
        last = start + begun if begun else max(start + self.patience.first, self._seen)
        if now - last <= self.patience.allowed:
            return Sign.WELL
        patient = now - start <= self.patience.startup
        return Sign.HANGS if self.patience.lasting and not patient else Sign.PAUSES

    @property
    def descriptors(self) -> list[int]:
        """What becomes readable when the loop dies, for ``select``."""
        return self._vigil.descriptors if self._vigil is not None else []

    @property
    def _has_died(self) -> bool:
        return self._vigil is not None and self._vigil.has_ended()

    @property
    def complaint(self) -> str:
        """A sentence about a loop that hangs."""
        named = f" of '{self.patience.name}'" if self.patience.name else ""
        return f"the loop{named} has given no sign of life for {self.patience.allowed / NANOSECONDS:g} s"
