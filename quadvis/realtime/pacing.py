"""What a pacer does at each tick: which tick runs, when, and what is counted.

All is done in whole numbers, by plain functions of words that can be indexed. Python runs them for the
interpreter, and numba compiles the same functions for the compiled loop, so the two cannot differ. ``plan``
is laid out by `plan`, ``shared`` by `control`, ``tasks`` are the words of all tasks as `times` has them,
``noted`` those of the rings of `notes`, ``box`` those of the parameter box, ``crew`` and ``memory`` are those
of `dispatch`. Instants are nanoseconds since the start.
"""

from __future__ import annotations

from typing import Any

from quadvis.native import loop
from quadvis.native.clock import GO
from quadvis.native.routine import Routine
from quadvis.realtime import box as box_words
from quadvis.realtime import clocks, control, dispatch, times
from quadvis.realtime.box import NUMBER, check
from quadvis.realtime.clocks import follow, now, signalled, sleep
from quadvis.realtime.dispatch import at_rest, release
from quadvis.realtime.grid import deadline, due_in, following, latest
from quadvis.realtime.notes import put_group, put_left_out, put_times
from quadvis.realtime.overload import ENDING, FAULTED, MEASURED, OVERLOADED, SIGNAL, missed, worse
from quadvis.realtime.plan import (
    BEGUN,
    COUNTED_TO,
    DUE,
    ENDED,
    EVERY,
    HEAD,
    IN_A_ROW,
    INSTANT,
    LATE,
    MEASUREMENT,
    NOTED,
    NOTES_ROOM,
    OFFSET,
    OWN,
    ROW,
    STARTING,
    STARTUP,
    STEPPING,
    TAKEN,
    TASKS,
    TICK,
    WAITING,
)  # fmt: skip
from quadvis.realtime.times import bin_of, count


def wait(
    plan: Any, shared: Any, tasks: Any, noted: Any, box: Any, clock: Any, crew: Any, memory: Any,
    tick: int, end: int,
) -> int:  # fmt: skip
    """Wait until a tick from ``tick`` on may run, which ``plan[WAITING]`` is then, at most ``end``.

    Return `GO`, and the step has begun; or why it has not: then the wait goes on when it is called again.
    """
    if plan[WAITING] < 0:
        finish(plan, shared, tasks, noted, now(clock))  # by the clock by which the step began
        follow(clock, shared[control.SHIFT])
        instant = now(clock)
        plan[WAITING], plan[INSTANT], plan[COUNTED_TO] = following(plan, tick, instant), instant, tick
    if shared[control.MEASUREMENT] != plan[MEASUREMENT]:
        plan[MEASUREMENT] = shared[control.MEASUREMENT]
        return MEASURED
    chosen, instant = plan[WAITING], plan[INSTANT]
    if chosen < end:
        due = deadline(plan, chosen)
        while True:
            if crew[dispatch.FAULT] != 0:
                return FAULTED
            if shared[control.END] != 0:
                return ENDING
            if instant >= due:
                break
            if signalled(clock):
                return SIGNAL
            sleep(clock, due)
            instant = now(clock)
            plan[INSTANT] = instant
        if instant >= deadline(plan, chosen + 1):
            chosen = max(chosen, latest(plan, instant))
    chosen = min(chosen, end)
    plan[WAITING] = chosen
    if chosen > plan[COUNTED_TO]:
        answer = _skip(plan, shared, tasks, noted, chosen)
        if answer != GO:
            return answer
    if chosen < end:
        if box[NUMBER] != plan[TAKEN]:
            _take(plan, box, noted, crew, memory, chosen)
        if plan[OWN] < plan[TASKS]:
            answer = release(plan, shared, tasks, noted, crew, memory, chosen)
            if answer != GO:
                return answer
        _begin(plan, shared, chosen, instant)
    return GO


def _take(plan: Any, box: Any, noted: Any, crew: Any, memory: Any, tick: int) -> None:
    """Write the group of a box into memory if it may hold from a tick on, and note so."""
    number = box[NUMBER]
    if (
        tick < box[box_words.NOT_BEFORE]
        or not 0 <= box[box_words.LENGTH] <= box[box_words.ROOM]
        or check(box, number) != box[box_words.CHECK]
    ):
        return
    if not at_rest(crew, box[box_words.TASKS]):
        return
    at, end = box_words.HEAD, box_words.HEAD + box[box_words.LENGTH]
    while at < end:
        slot, count = box[at], box[at + 1]
        at += box_words.ENTRY
        for index in range(count):
            memory[slot + index] = box[at + index]
        at += count
    plan[TAKEN] = number
    put_group(noted, number, tick)
    box[box_words.ANSWER] = tick * box_words.ANSWERS + number % box_words.ANSWERS


def _begin(plan: Any, shared: Any, tick: int, instant: int) -> None:
    for row in range(HEAD, HEAD + ROW * plan[OWN], ROW):
        waited = tick - plan[row + OFFSET]
        plan[row + DUE] = 1 if waited >= 0 and waited % plan[row + EVERY] == 0 else 0
    plan[STEPPING], plan[TICK], plan[BEGUN] = 1, tick, instant
    plan[LATE] = instant - deadline(plan, tick)
    shared[control.TICK] = tick
    shared[control.BEGUN] = max(1, instant)


def finish(plan: Any, shared: Any, tasks: Any, noted: Any, instant: int) -> None:
    """Count the step that has ended, if one was running; its times are those of each task in it."""
    if plan[STEPPING] == 0:
        return
    plan[STEPPING], plan[ENDED], plan[STARTING] = 0, instant, 0
    late, taken = plan[LATE], instant - plan[BEGUN]
    late_bin, taken_bin = bin_of(late), bin_of(taken)
    for task in range(plan[OWN]):
        row, words = HEAD + ROW * task, times.WORDS * task
        if plan[row + DUE] != 0:
            tasks[words + times.STEPS] += 1
            count(tasks, words + times.LATENESS, late, late_bin)
            count(tasks, words + times.TET, taken, taken_bin)
            overruns = tasks[words + times.OVERRUNS]
            put_times(noted, plan[row + NOTED], plan[row + NOTES_ROOM], plan[TICK], late, taken, overruns)
            plan[row + IN_A_ROW] = 0
            if tasks[words + times.STEPS] <= plan[row + STARTUP]:
                plan[STARTING] = 1
    shared[control.DONE] += 1
    shared[control.BEGUN] = 0


def _skip(plan: Any, shared: Any, tasks: Any, noted: Any, stop: int) -> int:
    """Note that the ticks before ``stop`` are left out, and count the overruns; return what follows."""
    start, plan[COUNTED_TO] = plan[COUNTED_TO], stop
    answer, done = GO, False
    for task in range(plan[OWN]):
        row = HEAD + ROW * task
        found = due_in(plan[row + EVERY], plan[row + OFFSET], start, stop)
        if found > 0:
            if not done:
                put_left_out(noted, start, stop - start)
                done = True
            tasks[times.WORDS * task + times.OVERRUNS] += found
            answer = worse(answer, missed(plan, shared, task, found, start, plan[STARTING]))
            if answer == OVERLOADED:
                break
    return answer


def pace(
    steering: Any, plan: Any, shared: Any, tasks: Any, noted: Any, box: Any, clock: Any, crew: Any,
    memory: Any,
) -> None:  # fmt: skip
    """Wait as the clock of the compiled loop, whose control words are ``steering``."""
    steering[loop.PAUSE] = wait(
        plan, shared, tasks, noted, box, clock, crew, memory, steering[loop.TICK], steering[loop.UNTIL]
    )
    if steering[loop.PAUSE] == GO:
        steering[loop.TICK] = plan[WAITING]
        plan[WAITING] = -1


PACE = Routine(pace, "wwwwwwwww", {**clocks.MACHINE, **dispatch.MACHINE})
