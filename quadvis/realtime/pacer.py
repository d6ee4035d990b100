"""The clock of a real-time run: it lets each tick go at its deadline, and measures and counts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NoReturn

from quadvis.errors import RunError, sentence
from quadvis.realtime import control, times
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.overload import OverloadWatch
from quadvis.realtime.ring import put_pair
from quadvis.realtime.schedule import NANOSECONDS, Schedule
from quadvis.units import Unit, format_quantity

SECOND = Unit.parse("s")
REMEDY = "make the blocks faster or the rate lower, or allow overruns with the key 'overload'"


class Ended(Exception):
    """The run is to end before its stop time, between two steps."""


class Pacer:
    """Lets the ticks of a schedule go, each at its deadline; see `quadvis.engine.clock.Clock`.

    A tick may begin until the next one is due. A tick that is due while an earlier step is running, or that
    the loop wakes too late for, is left out: the run goes on with a later tick of the same grid, and the
    tasks that were due there have an overrun.

    ``now`` gives the present instant, ``sleep`` waits until an instant (ns since the start) or returns
    earlier, for instance after a signal.
    """

    def __init__(
        self,
        schedule: Schedule,
        watch: OverloadWatch,
        shared: SharedMemory,
        now: Callable[[], int],
        sleep: Callable[[int], None],
    ) -> None:
        self._schedule, self._watch = schedule, watch
        self._now, self._sleep = now, sleep
        self._control: Any = shared.control
        self._tasks: list[Any] = shared.tasks
        self._left_out = shared.left_out.words
        for words in self._tasks:
            times.clear(words)
        self._rhythms = list(enumerate(schedule.rhythms))
        self._due: list[int] = []  # the tasks of the step that is running
        self._tick = 0
        self._begun = self._end = self._late = 0

    def wait(self, tick: int, end: int) -> range:
        """Wait for the deadline of the next tick; return this tick.

        RunError if tasks have more overruns than they may have; `Ended` if the run is to end.
        """
        instant = self._now()
        self.finish(instant)
        chosen = self._schedule.next(tick, instant)
        if chosen < end:
            instant = self._slept(self._schedule.deadline(chosen))
            if instant >= self._schedule.deadline(chosen + 1):
                chosen = max(chosen, self._schedule.latest(instant))
        if chosen > tick:
            self._skip(tick, min(chosen, end), instant)
        if chosen >= end:
            return range(end, end)
        self._begin(chosen, instant)
        return range(chosen, chosen + 1)

    def _slept(self, deadline: int) -> int:
        """Return the instant at which the wait for a deadline is over."""
        while True:
            if self._control[control.END]:
                raise Ended
            self._sleep(deadline)
            instant = self._now()
            if instant >= deadline:
                return instant

    def _begin(self, tick: int, instant: int) -> None:
        self._due = [
            task for task, (every, offset) in self._rhythms if tick >= offset and (tick - offset) % every == 0
        ]
        self._tick, self._begun = tick, instant
        self._late = instant - self._schedule.deadline(tick)
        self._control[control.TICK] = tick
        self._control[control.BEGUN] = instant or 1

    def finish(self, instant: int | None = None) -> None:
        """Count the step that has ended; its times are those of each task in it."""
        if not self._due:
            return
        self._end = self._now() if instant is None else instant
        taken = self._end - self._begun
        late, late_bin, taken_bin = self._late, times.bin_of(self._late), times.bin_of(taken)
        for task in self._due:
            words = self._tasks[task]
            words[times.STEPS] += 1
            times.count(words, times.LATENESS, late, late_bin)
            times.count(words, times.TET, taken, taken_bin)
        self._watch.ran(self._due, min([self._tasks[task][times.STEPS] for task in self._due]))
        self._due = []
        self._control[control.DONE] += 1
        self._control[control.BEGUN] = 0

    def _skip(self, tick: int, stop: int, instant: int) -> None:
        """Note that the ticks from ``tick`` to ``stop`` are left out, and count the overruns."""
        if any(rhythm.due_in(tick, stop) for _, rhythm in self._rhythms):
            put_pair(self._left_out, control.LEFT_OUT[0], tick, stop - tick)
        for task, rhythm in self._rhythms:
            count = rhythm.due_in(tick, stop)
            if count:
                words = self._tasks[task]
                words[times.OVERRUNS] += count
                exceeded = self._watch.missed(task, count)
                if exceeded:
                    self._refuse(exceeded, rhythm.first(tick), instant)

    def _refuse(self, exceeded: str, tick: int, instant: int) -> NoReturn:
        if self._end > self._schedule.deadline(tick):
            before = self._schedule.deadline(self._tick) / NANOSECONDS
            cause = f"the step of t = {before:.9g} s took {_time(self._end - self._begun)}"
        else:
            cause = f"the loop woke {_time(instant - self._schedule.deadline(tick))} late"
        reason = sentence(f"{exceeded}: {cause}", REMEDY)
        raise RunError(reason, time=self._schedule.deadline(tick) / NANOSECONDS)


def _time(nanoseconds: int) -> str:
    return format_quantity(nanoseconds / NANOSECONDS, SECOND, 3)
