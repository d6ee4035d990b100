"""The times of a task in a real-time run: how often it ran, how late it began, and how long it took.

They lie in memory that the loop writes and another process reads, so nothing grows: a time is counted in one
of the bins of a histogram, whose widths are 1/16 of the time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

FINE = 4  # bits of a time that tell the bins between two powers of two
OCTAVES = 40  # up to 2**40 ns, some 18 minutes; what is longer is counted in the last bin
BINS = (OCTAVES - FINE + 1) << FINE
STEPS, OVERRUNS, LATENESS = 0, 1, 2  # words of a task
TOTAL, LEAST, MOST, COUNTS = range(4)  # words of a measured time; its histogram begins at COUNTS
TET = LATENESS + COUNTS + BINS
WORDS = TET + COUNTS + BINS


def bin_of(time: int) -> int:
    """Return the bin of a time (ns)."""
    shift = math.frexp(float(time))[1] - FINE - 1  # the bits of the time, as machine code knows them, too
    if shift <= 0:
        return max(0, time)
    return min((shift << FINE) + (time >> shift), BINS - 1)


def end_of(number: int) -> int:
    """Return the time (ns) at which a bin ends: the first that is too long for it."""
    shift, rest = (number >> FINE) - 1, number & ((1 << FINE) - 1)
    return number + 1 if shift < 0 else (rest + (1 << FINE) + 1) << shift


@dataclass(frozen=True)
class Spread:
    """Measured times (s): the least, the mean, the largest, and that which 1 in 100, 1 in 1000 exceed.

    The last two are ends of bins, at most 1/16 too large, and never larger than the largest. ``bins`` are
    those of the histogram that hold times: begin, end, count.
    """

    least: float
    mean: float
    most: float
    p99: float
    p999: float
    bins: tuple[tuple[float, float, int], ...] = ()

    def facts(self) -> dict[str, Any]:
        """Return the times as plain data."""
        return {
            "min_s": self.least, "mean_s": self.mean, "max_s": self.most,
            "p99_s": self.p99, "p99.9_s": self.p999,
            "histogram": [{"from_s": start, "to_s": end, "count": count} for start, end, count in self.bins],
        }  # fmt: skip


@dataclass(frozen=True)
class TaskTimes:
    """What a task did in a run: its steps, its overruns, its lateness and its execution time (TET).

    Lateness is the time from a deadline to the begin of the step; TET that from the begin of the step to its
    end. Both are None for a task without a step. A step runs all tasks that are due, and counts for each.
    """

    task: str
    period: float
    steps: int
    overruns: int
    lateness: Spread | None
    execution: Spread | None

    @staticmethod
    def read(task: str, period: float, words: Any) -> TaskTimes:
        """Return the times from the words that the loop has written."""
        values = np.array(words, np.int64)
        steps, overruns = int(values[STEPS]), int(values[OVERRUNS])
        return TaskTimes(
            task, period, steps, overruns, _spread(values[LATENESS:TET]), _spread(values[TET:WORDS])
        )

    def facts(self) -> dict[str, Any]:
        """Return the times as plain data."""
        return {
            "period_s": self.period,
            "steps": self.steps,
            "overruns": self.overruns,
            "lateness": self.lateness.facts() if self.lateness else None,
            "execution": self.execution.facts() if self.execution else None,
        }


def clear(words: Any) -> None:
    """Prepare the words of a task, which are all 0, for `count`."""
    words[LATENESS + LEAST] = words[TET + LEAST] = np.iinfo(np.int64).max


def count(words: Any, at: int, time: int, number: int) -> None:
    """Count a time (ns) whose bin has a number; the words of this time begin at ``at``."""
    words[at] += time
    if time < words[at + LEAST]:
        words[at + LEAST] = time
    if time > words[at + MOST]:
        words[at + MOST] = time
    words[at + COUNTS + number] += 1


def _spread(words: Any) -> Spread | None:
    """Return the spread of a measured time from its words."""
    counts = words[COUNTS:]
    total = int(counts.sum())
    if not total:
        return None
    least, most = int(words[LEAST]), int(words[MOST])

    def exceeded_by(part: float) -> float:
        place = int(np.searchsorted(np.cumsum(counts), total * (1 - part)))
        return min(end_of(place), most) / 1e9

    bins = [
        ((end_of(number - 1) if number else 0) / 1e9, end_of(number) / 1e9, int(counts[number]))
        for number in np.flatnonzero(counts).tolist()
    ]
    mean, p99, p999 = int(words[TOTAL]) / total / 1e9, exceeded_by(1e-2), exceeded_by(1e-3)
    return Spread(least / 1e9, mean, most / 1e9, p99, p999, tuple(bins))
