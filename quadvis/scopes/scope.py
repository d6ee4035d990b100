"""A scope: a state machine that takes samples row by row and hands them on as packages.

Its rows are numbered from 0. Within the rows that have come it can say where its next event is: it is
triggered, its package is whole, or it triggers others. So scopes that trigger each other go from event to
event in the order of ticks (`linked`), and however many rows come at once, the packages are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis.output.stretch import NANOSECONDS, stamps_of
from quadvis.scopes.collecting import SampleBuffer, crossings
from quadvis.scopes.package import Package
from quadvis.scopes.properties import AT_END, FILE, FREERUN, SIGNAL
from quadvis.scopes.ring import SampleRing
from quadvis.scopes.rows import NO_TICKS, Samples, Ticks
from quadvis.scopes.settings import ScopeSettings
from quadvis.scopes.source import ScopePlan

ACQUIRING = "Acquiring"
READY = "Ready for being Triggered"
INTERRUPTED = "Interrupted"
FINISHED = "Finished"

Take = Callable[[Package], object]


class Phase(Enum):
    """What a scope does. A waiting one whose samples before the trigger are not all there is acquiring."""

    STOPPED = 0
    WAITING = 1
    COLLECTING = 2
    DONE = 3


@dataclass
class Cycle:
    """One acquisition as other scopes see it: the rows of its trigger and of the sample after its last one.

    Other scopes know of what lies before the row ``passed``.
    """

    trigger: int
    after: int
    passed: int


class SignalScope:
    """A scope over signals, as in xPC Target, and what it has collected.

    ``open`` gives it rows, `linked.run` lets it take them, ``close`` ends this. ``take`` gets its packages.
    ``watched`` are the samples for which other scopes wait (-1: the one after the last).
    """

    def __init__(
        self, number: int, settings: ScopeSettings, plan: ScopePlan, tick: Fraction, take: Take
    ) -> None:
        self.number, self.settings, self.plan = number, settings, plan
        self.watched: frozenset[int] = frozenset()
        self.latest: Package | None = None
        self.tick, self._take = tick, take
        self._width = len(plan.traces)
        self._phase = Phase.STOPPED
        self._sequence = 0
        self._base = 0  # the number of the first row that is open, or of the next one
        self._ticks: Ticks = NO_TICKS
        self._samples: Samples = np.zeros((0, 0))
        self._ring = SampleRing(0, 0)
        self._cycles: list[Cycle] = []
        self._level = np.nan  # the value of the trigger's signal in the row before
        self._crossings: NDArray[np.int64] | None = None
        self._ready = 0  # the first row that can be a trigger
        self._forced = False  # triggered by hand
        self._caused: int | None = None  # triggered by another scope, at this row
        self._buffer = SampleBuffer(0, 0, 1, 0)
        self._before: tuple[int, int] | None = None  # row and tick of the last sample, if no gap may follow

    @property
    def status(self) -> str:
        """Its status, in xPC Target's words."""
        if self._phase is Phase.WAITING:
            return READY if self._base >= self._ready else ACQUIRING
        return {
            Phase.STOPPED: INTERRUPTED, Phase.COLLECTING: ACQUIRING, Phase.DONE: FINISHED,
        }[self._phase]  # fmt: skip

    @property
    def running(self) -> bool:
        """Whether it acquires or waits for its trigger."""
        return self._phase in (Phase.WAITING, Phase.COLLECTING)

    @property
    def active(self) -> bool:
        """Whether it takes rows: it runs, or others still wait for the sample after its last one."""
        return self.running or (self._phase is Phase.DONE and bool(self._cycles and self.watched))

    def start(self) -> None:
        """Begin with the next row; a scope that runs goes on."""
        if self.running:
            return
        self.settings.check_start(f"scope {self.number}", self._width)
        self._level, self._before = np.nan, None
        self._ring = SampleRing(self.settings.before * self.settings.Decimation, self._width)
        if self.settings.TriggerMode == FREERUN:
            self._begin(self._base)
        else:
            self._arm(self._base)

    def stop(self) -> None:
        """End at once. A file scope hands on what it has collected; others forget it."""
        if self._phase is Phase.COLLECTING and self.settings.Type == FILE and self._buffer.filled:
            self._hand_on(self._buffer.filled)
        self._phase = Phase.STOPPED
        self._cycles.clear()

    def finish(self) -> None:
        """End a scope that can write no more: it is Finished, and what it has collected is forgotten."""
        self._phase = Phase.DONE
        self._cycles.clear()

    def follow(self, other: SignalScope) -> None:
        """Take the place of a scope with other settings: its packages are counted on."""
        self._sequence, self._phase = other._sequence, other._phase

    def trigger(self) -> None:
        """Trigger it at the next row, or once the samples before the trigger are there."""
        if self._phase is not Phase.WAITING:
            remedy = "it is triggered" if self.running else "start it first"
            raise QuadvisError(f"scope {self.number} does not wait for a trigger; {remedy}")
        self._forced = True

    def open(self, ticks: Ticks, samples: Samples) -> None:
        """Give it rows: ticks (N,), samples (N, columns of its plan)."""
        self._ticks, self._samples = ticks, samples
        self._crossings = None

    def close(self) -> None:
        """Let it take the rows up to the last one."""
        end = self._end
        if self._phase is Phase.COLLECTING:
            self._collect(end)
        if len(self._ticks):
            if self.settings.before:
                self._ring.put(self._base, self._ticks, self._samples[:, : self._width])
            self._level = float(self._samples[-1, -1]) if self.plan.trigger else np.nan
        self._base = end
        for cycle in self._cycles:
            cycle.passed = max(cycle.passed, end)
        self._cycles = [cycle for cycle in self._cycles if cycle.after >= end]
        self.open(NO_TICKS, self._samples[:0])

    def next_event(self) -> tuple[int, int] | None:
        """Return the tick and the row of its next event; None if there is none in the open rows."""
        rows = [row for cycle in self._cycles for row in self._seen(cycle).values()]
        if self._phase is Phase.WAITING:
            rows += self._own_triggers()
        elif self._phase is Phase.COLLECTING:
            rows.append(max(self._buffer.last, self._base))
        row = min(rows, default=self._end)
        return (int(self._ticks[row - self._base]), row) if row < self._end else None

    def pass_event(self, row: int) -> list[int]:
        """Let the next event happen; return the samples that others may wait for and that are at this row."""
        if self._phase is Phase.WAITING and row in self._own_triggers():
            self._begin(row)
        elif self._phase is Phase.COLLECTING and max(self._buffer.last, self._base) == row:
            self._finish()
        else:
            found = [sample for cycle in self._cycles for sample in self._take_seen(cycle, row)]
            return found
        return []

    def cause(self, tick: int) -> None:
        """Trigger it by another scope, at its first row from a tick on, if it is ready there."""
        row = self._base + int(np.searchsorted(self._ticks, tick))
        if self._phase is Phase.WAITING and row >= self._ready:
            self._caused = row

    @property
    def _end(self) -> int:
        """The number of the row after the last open one."""
        return self._base + len(self._ticks)

    def _own_triggers(self) -> list[int]:
        """Return the rows at which it is triggered next, for each cause, as far as they are known."""
        ready = max(self._ready, self._base)
        found = [ready] if self._forced else []
        if self._caused is not None:
            found.append(self._caused)
        if self.settings.TriggerMode == SIGNAL:
            if self._crossings is None:
                level, slope = self.settings.TriggerLevel, self.settings.TriggerSlope
                self._crossings = crossings(self._level, self._samples[:, -1], level, slope) + self._base
            place = int(np.searchsorted(self._crossings, ready))
            found += self._crossings[place : place + 1].tolist()
        return found

    def _seen(self, cycle: Cycle) -> dict[int, int]:
        """Return the rows of the samples for which others wait, by sample, as far as they are to come."""
        step = self.settings.Decimation
        rows = {
            sample: cycle.after if sample == AT_END else cycle.trigger + sample * step
            for sample in self.watched
        }
        return {
            sample: row
            for sample, row in rows.items()
            if row >= cycle.passed and (sample == AT_END or row < cycle.after)
        }

    def _take_seen(self, cycle: Cycle, row: int) -> list[int]:
        found = [sample for sample, at in self._seen(cycle).items() if at == row]
        if found:
            cycle.passed = row + 1
        return found

    def _arm(self, row: int) -> None:
        """Wait for a trigger; the samples before it are taken from a row on."""
        self._phase = Phase.WAITING
        self._ready = row + self.settings.before * self.settings.Decimation
        self._forced, self._caused = False, None

    def _begin(self, row: int) -> None:
        """Begin a package whose trigger is at a row."""
        step, count = self.settings.Decimation, self.settings.NumSamples
        self._phase = Phase.COLLECTING
        self._buffer = SampleBuffer(row + self.settings.shift * step, count, step, self._width)
        self._cycles = [cycle for cycle in self._cycles if self._seen(cycle)]
        self._cycles.append(Cycle(row, self._buffer.last + step, row))

    def _collect(self, end: int) -> None:
        """Take the samples of the package before a row."""
        self._buffer.collect(end, self._base, self._ticks, self._samples, self._ring)

    def _finish(self) -> None:
        """Hand the package on, and begin anew if this is so set."""
        last, trigger = self._buffer.last, self._cycles[-1].trigger
        self._collect(last + 1)
        package = self._hand_on(self.settings.NumSamples)
        if not self.settings.restarts:
            self._phase = Phase.DONE
        elif self.settings.TriggerMode == FREERUN:
            self._before = last, int(package.ticks[-1])
            self._begin(last + self.settings.Decimation)
        else:
            self._arm(max(last, trigger) + 1)

    def _hand_on(self, count: int) -> Package:
        """Hand the first samples of the package on."""
        self.latest = self._package(count)
        self._sequence += 1
        self._take(self.latest)
        return self.latest

    def _package(self, count: int) -> Package:
        ticks, samples = self._buffer.samples(count)
        last = self._buffer.first + (count - 1) * self._buffer.step
        row, tick = self._before or (self._buffer.first, int(ticks[0]))
        return Package(
            scope=self.number,
            sequence=self._sequence,
            ticks=ticks,
            times=stamps_of(ticks, self.tick) / NANOSECONDS,
            samples=samples,
            names=tuple(trace.name for trace in self.plan.traces),
            units=tuple(trace.unit for trace in self.plan.traces),
            trigger=None if self.settings.TriggerMode == FREERUN else -self.settings.shift,
            lost=(int(ticks[-1]) - tick) // self.plan.spacing - (last - row),
        )

    def picture(self) -> Package | None:
        """Return its newest samples, whole or not, at most as many as a package has; None without any."""
        filled = self._buffer.filled if self._phase is Phase.COLLECTING else 0
        if not filled:
            return self.latest
        now = self._package(filled)
        if self.latest is None or filled >= len(self.latest):
            return now
        return self.latest.followed_by(now)
