"""A stretch of a run in which a signal is judged, in exact time, and the rows of the signal in it."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

NANOSECONDS = 10**9
MOST = 2**63 - 1  # of a stamp


def stamp(time: Fraction) -> int:
    """Return a time (s) as a row's stamp: in whole nanoseconds, rounded down."""
    return math.floor(time * NANOSECONDS)


def stamps_of(ticks: NDArray[np.int64], period: Fraction) -> NDArray[np.int64]:
    """Return the stamps (ns) of ticks, rounded down."""
    return scaled(ticks, *(period * NANOSECONDS).as_integer_ratio())


def scaled(ticks: NDArray[np.int64], numerator: int, denominator: int) -> NDArray[np.int64]:
    """Return ascending ticks times a quotient, rounded down."""
    if len(ticks) and int(ticks[-1]) * numerator > MOST:
        return np.array([tick * numerator // denominator for tick in ticks.tolist()], np.int64)
    return ticks * numerator // denominator


def seconds_text(time: Fraction) -> str:
    """Return a time in seconds as exact text: a decimal number if possible."""
    return f"{float(time):.12g} s" if (10**12 * time).denominator == 1 else f"{time} s"


@dataclass(frozen=True)
class Sampling:
    """The times of a signal's rows: at ``offset`` and every ``spacing`` after it, up to ``end``.

    All are exact times (s); ``end`` is the end of the run. ``shortened`` marks a run that was told to end
    before its diagram's stop time.
    """

    offset: Fraction = Fraction(0)
    spacing: Fraction = Fraction(1)
    end: Fraction = Fraction(0)
    shortened: bool = field(default=False, compare=False)  # it changes words only, never a verdict

    def time(self, row: int) -> Fraction:
        """Return the time (s) of a row; rows are counted from 0."""
        return self.offset + row * self.spacing


@dataclass(frozen=True)
class Stretch:
    """The rows from ``after`` to ``before`` (s), both included; ``before`` None is the end of the run."""

    sampling: Sampling
    after: Fraction = Fraction(0)
    before: Fraction | None = None

    @cached_property
    def rows(self) -> range:
        """The numbers of its rows in a run that reaches its end."""
        first = math.ceil((self.after - self.sampling.offset) / self.sampling.spacing)
        end = self.sampling.end if self.before is None else min(self.before, self.sampling.end)
        last = math.floor((end - self.sampling.offset) / self.sampling.spacing)
        return range(max(first, 0), max(first, last + 1, 0))

    @property
    def stamps(self) -> tuple[int, int]:
        """The stamps (ns) of its first and last row; rows of a log with stamps between them lie in it."""
        rows = self.rows
        if not rows:
            return 0, -1
        return stamp(self.sampling.time(rows[0])), stamp(self.sampling.time(rows[-1]))

    def lack(self, found: int) -> str:
        """Return why so many rows are not the whole stretch; "" if they are."""
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
        """Return the stretch in words; "" for a whole run."""
        after = f"after {seconds_text(self.after)}" if self.after else ""
        before = f"before {seconds_text(self.before)}" if self.before is not None else ""
        return " and ".join(filter(None, (after, before)))

    @property
    def cut(self) -> str:
        """Its end in words, if it has no end of its own and the run was told to end early."""
        is_cut = self.before is None and self.sampling.shortened
        return f"up to {seconds_text(self.sampling.end)}" if is_cut else ""
