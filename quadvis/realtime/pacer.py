"""The clock of a real-time run: it lets each tick go at its deadline, and measures and counts."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from quadvis.diagram.sections.overload import OverloadLimits
from quadvis.engine.memory import Memory
from quadvis.errors import RunError, counted, sentence
from quadvis.realtime import control, dispatch, overload, pacing, times
from quadvis.realtime import plan as plans
from quadvis.realtime.clocks import Timekeeper
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.grid import deadline, due_in, first_from
from quadvis.realtime.notes import put_release
from quadvis.realtime.plan import make_plan
from quadvis.realtime.schedule import NANOSECONDS, Schedule
from quadvis.realtime.words import address_of, whole_words
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

    ``names`` and ``limits`` are those of the tasks, ``computer`` is the name of theirs for messages. ``save``
    is called where overruns are to make the outputs safe; ``unsafe`` says then why. ``measure`` takes the
    number of a measurement of blocks' times that begins or is over. The interpreter asks
    `wait`; the compiled loop calls the machine code at ``address``, which does the same
    (`quadvis.native.clock.MachineClock`).
    """

    def __init__(
        self,
        schedule: Schedule,
        names: Sequence[str],
        limits: Sequence[OverloadLimits],
        shared: SharedMemory,
        clock: Timekeeper,
        save: Callable[[], None] | None = None,
        computer: str = "",
        measure: Callable[[int], None] | None = None,
    ) -> None:
        self._names, self._limits, self._save, self._measure = names, limits, save, measure
        self._of = f" of '{computer}'" if computer else ""
        self.unsafe = ""
        self._plan = make_plan(schedule, limits, shared.notes.rooms)
        self._control: Any = shared.control
        self._times: Any = shared.times
        self._noted: Any = shared.notes.words
        self._box: Any = shared.box.words
        self.clock = clock
        self._crew: Any = whole_words(dispatch.HEAD)
        self._memory: Any = whole_words(1)
        self._fault: Callable[[], Exception] | None = None
        for task in shared.tasks:
            times.clear(task)

    def write_into(self, memory: Memory) -> None:
        """Let what comes by the parameter box, and what tasks give others, go into an engine's memory."""
        self._memory = memory.raw.cast("q")

    def lead(self, crew: Any, fault: Callable[[], Exception]) -> None:
        """Dispatch all tasks but the first, which run by themselves; see `dispatch` for the plans.

        ``fault`` gives the error where one of them has failed.
        """
        self._plan[plans.OWN] = 1
        self._crew, self._fault = crew, fault

    @property
    def words(self) -> tuple[Any, Any, Any, Any, Any, Any, Any, Any]:
        """All that `pacing.wait` takes before the ticks."""
        return (
            self._plan, self._control, self._times, self._noted, self._box, self.clock, self._crew,
            self._memory,
        )  # fmt: skip

    @property
    def address(self) -> int:
        """The address of its machine code."""
        from quadvis.native.library import library

        return library().routine(pacing.PACE)

    @property
    def places(self) -> Sequence[int]:
        """The addresses of the words of its machine code."""
        *before, clock, crew, memory = self.words
        return [address_of(each) for each in (*before, clock.words, crew, memory)]

    def wait(self, tick: int, end: int) -> range:
        """Wait for the deadline of the next tick; return this tick.

        RunError if tasks have more overruns than they may have; `Ended` if the run is to end.
        """
        plan = self._plan
        while pause := pacing.wait(*self.words, tick, end):
            self.answer(pause)
        chosen, plan[plans.WAITING] = plan[plans.WAITING], -1
        return range(chosen, min(chosen + 1, end))

    def answer(self, pause: int) -> None:
        """Do what follows a wait that has not begun a step."""
        if pause == overload.ENDING:
            raise Ended
        if pause == overload.FAULTED:
            assert self._fault is not None
            raise self._fault()
        if pause == overload.OVERLOADED:
            raise self._overload()
        if pause == overload.MEASURED and self._measure is not None:
            self._measure(self._plan[plans.MEASUREMENT])
        if pause == overload.UNSAFE:
            self.unsafe = f"t = {self._missed:.9g} s: {self._exceeded()}"
            if self._save is not None:
                self._save()

    def finish(self) -> None:
        """Count the step that has ended."""
        pacing.finish(self._plan, self._control, self._times, self._noted, self.clock.now())

    def live(self) -> bool:
        """Give a sign of life while no step runs; return whether the run goes on."""
        self._control[control.DONE] += 1
        return not self._control[control.END]

    def conclude(self, rest: Callable[[Callable[[], object]], None], end: int) -> None:
        """Let ``rest`` wait for the tasks that run by themselves; count ticks never dispatched.

        It calls what it is given again and again. A wait that takes too long is a step that does so.
        """
        self._control[control.RESTING] = max(1, self.clock.now())
        rest(self.live)
        self._control[control.RESTING] = 0
        for task in range(1, self._crew[dispatch.COUNT]):
            row = plans.HEAD + plans.ROW * task
            rhythm = self._plan[row + plans.EVERY], self._plan[row + plans.OFFSET]
            seen = self._crew[dispatch.HEAD + dispatch.ROW * task + dispatch.SEEN]
            found = due_in(*rhythm, seen, end)
            self._times[times.WORDS * task + times.OVERRUNS] += found
            if found:
                put_release(self._noted, task, first_from(*rhythm, seen), found, -1)

    def _overload(self) -> RunError:
        plan = self._plan
        due, task = deadline(plan, plan[plans.MISSED]), plan[plans.EXCEEDED]
        if task >= plan[plans.OWN]:
            running = self._crew[dispatch.HEAD + dispatch.ROW * task + dispatch.TICK]
            cause = f"its step of t = {deadline(plan, running) / NANOSECONDS:.9g} s is not through"
        elif plan[plans.ENDED] > due:
            before = deadline(plan, plan[plans.TICK]) / NANOSECONDS
            cause = f"the step of t = {before:.9g} s took {_time(plan[plans.ENDED] - plan[plans.BEGUN])}"
        else:
            cause = f"the loop woke {_time(plan[plans.INSTANT] - due)} late"
        return RunError(sentence(f"{self._exceeded()}: {cause}", REMEDY), time=self._missed)

    @property
    def _missed(self) -> float:
        """The time of the tick that was one too many (s)."""
        return deadline(self._plan, self._plan[plans.MISSED]) / NANOSECONDS

    def _exceeded(self) -> str:
        """Return which limit of which task has been exceeded."""
        plan = self._plan
        task, found = plan[plans.EXCEEDED], plan[plans.FOUND]
        limits, name = self._limits[task], f"task '{self._names[task]}'{self._of}"
        overruns = counted(found, "overrun")
        if plan[plans.LIMIT] == plans.IN_ALL:
            return f"{name}: overload limit ({limits.max}) exceeded with {overruns}"
        return f"{name}: overload limit ({limits.consecutive} in a row) exceeded with {overruns} in a row"


def _time(nanoseconds: int) -> str:
    return format_quantity(nanoseconds / NANOSECONDS, SECOND, 3)
