"""A stretch of a run in which a signal is judged, in exact time: which of the signal's rows lie in it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction

NANOSECONDS = 10**9


def stamp(time: Fraction) -> int:
    """Return a time (s) as rows are stamped with it: in whole nanoseconds, rounded down."""
    return math.floor(time * NANOSECONDS)


def seconds_text(time: Fraction) -> str:
    """Return a time for people in seconds, exactly: a decimal number if it is one."""
    return f"{float(time):.12g} s" if (10**12 * time).denominator == 1 else f"{time} s"


@dataclass(frozen=True)
class Sampling:
    """When a signal has rows: at ``offset``, every ``spacing`` from there, the last one at ``end`` or before.

    All are exact times (s); ``end`` is when the run ends. ``shortened`` is a run that was asked to end before
    its diagram does.
    """

    offset: Fraction = Fraction(0)
    spacing: Fraction = Fraction(1)
    end: Fraction = Fraction(0)
    shortened: bool = field(default=False, compare=False)  # it changes words, no verdict

    def time(self, row: int) -> Fraction:
        """Return the time of a row (s); they are counted from 0."""
        return self.offset + row * self.spacing


@dataclass(frozen=True)
class Stretch:
    """The rows from ``after`` to ``before`` (s), both included; None is the end of the run."""

    sampling: Sampling
    after: Fraction = Fraction(0)
    before: Fraction | None = None

    @property
    def rows(self) -> range:
        """The numbers of the rows that belong to it, of a run that goes on to its end."""
        first = math.ceil((self.after - self.sampling.offset) / self.sampling.spacing)
        end = self.sampling.end if self.before is None else min(self.before, self.sampling.end)
        last = math.floor((end - self.sampling.offset) / self.sampling.spacing)
        return range(max(first, 0), max(first, last + 1, 0))

    @property
    def stamps(self) -> tuple[int, int]:
        """The stamps (ns) of its first and its last row, which is how a log tells that a row lies in it."""
        rows = self.rows
        if not rows:
            return 0, -1
        return stamp(self.sampling.time(rows[0])), stamp(self.sampling.time(rows[-1]))

    def lack(self, found: int) -> str:
        """Return why a verdict on so many rows would not be one on the whole stretch; empty if it is one."""
        end = seconds_text(self.sampling.end)
        if self.after > self.sampling.end:
            return f"the run ends at {end}, the window begins at {seconds_text(self.after)}"
        if self.before is not None and self.before > self.sampling.end:
            return f"the run ends at {end}, the window at {seconds_text(self.before)}"
        if not self.rows:
            return "no sample lies in the window"
        if found < len(self.rows):
            return f"{found} of its {len(self.rows)} samples are there"
        return ""

    def __str__(self) -> str:
        """Return it in words; empty if it is all of a run."""
        after = f"after {seconds_text(self.after)}" if self.after else ""
        before = f"before {seconds_text(self.before)}" if self.before is not None else ""
        return " and ".join(filter(None, (after, before)))

    @property
    def cut(self) -> str:
        """How far it goes in words, if it has no end of its own and the run was asked to end early."""
        is_cut = self.before is None and self.sampling.shortened
        return f"up to {seconds_text(self.sampling.end)}" if is_cut else ""
