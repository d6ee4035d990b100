"""How the threads of tasks that run each by itself start and wait: `tasking: multi` in real time.

The loop of the fastest task dispatches the others. At each tick it releases those that are due: a task that
still runs has an overrun instead. Late values of a released task are swapped then. What it reads of faster
tasks is latched for it once their outputs of the tick are there, by the thread that gave them, before that
one runs on. When nothing is missing any more the task's thread is woken. So a task never reads what another
one writes at the same time, on however many processors.

Plain functions of words, as in `pacing`. ``memory`` is the memory of the engine. A mutex guards the words;
its owner inherits the priority of whoever waits.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Mapping
from typing import Any

from quadvis.native import loop
from quadvis.native.clock import GO
from quadvis.native.foreign import system
from quadvis.native.routine import Routine
from quadvis.realtime import clocks, control, times
from quadvis.realtime import plan as plans
from quadvis.realtime.clocks import unshifted
from quadvis.realtime.grid import deadline, due_in, first_from
from quadvis.realtime.notes import put_release, put_times
from quadvis.realtime.overload import ENDING, MEASURED, missed, worse
from quadvis.realtime.times import bin_of, count

# Words of the head: how many tasks; how the threads are to end; that one has failed; by how much (ns) ticks
# are due later than by the start; the number of the measurement; a mutex, functions of C.
COUNT, QUIT, FAULT, SHIFT, MEASUREMENT = range(5)
MUTEX, LOCK, UNLOCK, POST, REST = range(5, 10)
HEAD = 10
# Words of a task's row, which the fastest does not use: what it does; its tick, and up to which tick it was
# dispatched; begin of its step, after the unshifted start, and its lateness; for how many tasks its start
# waits; that it was released at this tick; its semaphore; where its delays stand.
STATE, TICK, SEEN, BEGUN, LATE, WAITS, FRESH, SEMAPHORE, DELAYS = range(9)
ROW = 9
# Behind the rows two tables by giver and reader: whether the giver has to latch, and where the copies stand.
# Copies: how many, then for each the first slot to read, the first to write, and the number of slots.
IDLE, BUSY, GIVEN = range(3)  # GIVEN: it runs, and its outputs are there and stand still
LAST_BIT = 62  # of a word in which each task has a bit
AT_REST, AT_ONCE = 1, 2  # the threads end once they are idle, or after their step


def release(plan: Any, shared: Any, tasks: Any, noted: Any, crew: Any, memory: Any, tick: int) -> int:
    """Release the tasks that are due up to a tick and idle, and count the overruns of others; see `missed`.

    A task whose tick the loop has missed begins late, until its next tick is due. What begins late or not at
    all is noted.
    """
    answer = GO
    lock(crew)
    crew[SHIFT], crew[MEASUREMENT] = shared[control.SHIFT], shared[control.MEASUREMENT]
    for task in range(1, crew[COUNT]):
        row, rhythm = HEAD + ROW * task, plans.HEAD + plans.ROW * task
        every, offset, start = plan[rhythm + plans.EVERY], plan[rhythm + plans.OFFSET], crew[row + SEEN]
        found = due_in(every, offset, start, tick + 1)
        crew[row + SEEN] = tick + 1
        if found == 0:
            continue
        starting, late = plan[plans.STARTING], -1
        if crew[row + STATE] != IDLE:
            steps = tasks[times.WORDS * task + times.STEPS] + 1
            starting = 1 if steps <= plan[rhythm + plans.STARTUP] else 0
        else:
            found -= 1
            crew[row + STATE], crew[row + FRESH], crew[row + WAITS] = BUSY, 1, 1
            crew[row + TICK] = tick - (tick - offset) % every
            late = tick if crew[row + TICK] < tick else -1
            _copy(crew, memory, crew[row + DELAYS])
        if found > 0 or late >= 0:
            put_release(noted, task, first_from(every, offset, start), found, late)
        if found > 0:
            tasks[times.WORDS * task + times.OVERRUNS] += found
            answer = worse(answer, missed(plan, shared, task, found, start, starting))
    for task in range(1, crew[COUNT]):
        if crew[HEAD + ROW * task + FRESH] != 0:
            for giver in range(1, task):
                _order(crew, memory, giver, task)
    unlock(crew)
    return answer


def at_rest(crew: Any, tasks: int) -> bool:
    """Return whether none of some tasks, given as bits, is running; the fastest is not asked for."""
    found = True
    if crew[COUNT] == 0:
        return found
    lock(crew)
    for task in range(1, crew[COUNT]):
        if (tasks >> bit(task)) & 1 != 0 and crew[HEAD + ROW * task + STATE] != IDLE:
            found = False
    unlock(crew)
    return found


def bit(task: int) -> int:
    """Return the number of the bit of a task; the slowest of very many have one together."""
    return min(task, LAST_BIT)


def _order(crew: Any, memory: Any, giver: int, task: int) -> None:
    """Have a released task get what it reads of a faster one: now, unless its outputs are under way."""
    copies = crew[_latches(crew, giver, task)]
    if copies != 0 and crew[HEAD + ROW * giver + STATE] == BUSY:
        crew[_pending(crew, giver, task)] = 1
        crew[HEAD + ROW * task + WAITS] += 1
    elif copies != 0:
        _copy(crew, memory, copies)


def hand_over(crew: Any, memory: Any, own: Any) -> None:
    """Latch what slower tasks read of the task ``own[0]``, whose outputs are there, and wake them."""
    lock(crew)
    if own[0] != 0:
        crew[HEAD + ROW * own[0] + STATE] = GIVEN
        for task in range(own[0] + 1, crew[COUNT]):
            place = _pending(crew, own[0], task)
            if crew[place] != 0:
                crew[place] = 0
                _give(crew, memory, own[0], task)
    else:
        for task in range(1, crew[COUNT]):
            row = HEAD + ROW * task
            if crew[row + FRESH] != 0:
                crew[row + FRESH] = 0
                _give(crew, memory, 0, task)
    unlock(crew)


def _give(crew: Any, memory: Any, giver: int, task: int) -> None:
    """Latch what a task reads of another, and wake it if nothing else is missing."""
    row = HEAD + ROW * task
    _copy(crew, memory, crew[_latches(crew, giver, task)])
    crew[row + WAITS] -= 1
    if crew[row + WAITS] == 0:
        post(crew, crew[row + SEMAPHORE])


def _pending(crew: Any, giver: int, task: int) -> int:
    place: int = HEAD + ROW * crew[COUNT] + giver * crew[COUNT] + task
    return place


def _latches(crew: Any, giver: int, task: int) -> int:
    place: int = _pending(crew, giver, task) + crew[COUNT] * crew[COUNT]
    return place


def _copy(crew: Any, memory: Any, at: int) -> None:
    if at == 0:
        return
    for copy in range(at + 1, at + 1 + 3 * crew[at], 3):
        source, target = crew[copy], crew[copy + 1]
        for index in range(crew[copy + 2]):
            memory[target + index] = memory[source + index]


def enter(plan: Any, tasks: Any, noted: Any, clock: Any, crew: Any, own: Any) -> int:
    """Count the step of the task ``own[0]`` that has ended; wait until it is released.

    Return `GO`, and its step has begun, or `ENDING`; or `MEASURED`, and it is to be called again, once
    ``own[1]``, the number of the measurement of its thread, is another one.
    """
    row = HEAD + ROW * own[0]
    if crew[row + BEGUN] != 0:
        _leave(plan, tasks, noted, crew, own[0], unshifted(clock))
    while True:
        lock(crew)
        runs, quits = crew[row + STATE] != IDLE, crew[QUIT]
        ready = runs and crew[row + WAITS] == 0
        unlock(crew)
        if quits == AT_ONCE or (quits == AT_REST and not runs):
            return ENDING
        if ready:
            break
        rest(crew, crew[row + SEMAPHORE])
    if crew[MEASUREMENT] != own[1]:
        own[1] = crew[MEASUREMENT]
        return MEASURED
    instant = unshifted(clock)
    crew[row + BEGUN] = max(1, instant)
    crew[row + LATE] = instant - crew[SHIFT] - deadline(plan, crew[row + TICK])
    return GO


def _leave(plan: Any, tasks: Any, noted: Any, crew: Any, task: int, instant: int) -> None:
    row, words, planned = HEAD + ROW * task, times.WORDS * task, plans.HEAD + plans.ROW * task
    late, taken = crew[row + LATE], instant - crew[row + BEGUN]
    late_bin, taken_bin = bin_of(late), bin_of(taken)
    lock(crew)
    tasks[words + times.STEPS] += 1
    count(tasks, words + times.LATENESS, late, late_bin)
    count(tasks, words + times.TET, taken, taken_bin)
    start, room = plan[planned + plans.NOTED], plan[planned + plans.NOTES_ROOM]
    put_times(noted, start, room, crew[row + TICK], late, taken, tasks[words + times.OVERRUNS])
    plan[planned + plans.IN_A_ROW] = 0
    crew[row + STATE], crew[row + BEGUN] = IDLE, 0
    unlock(crew)


def gate(steering: Any, plan: Any, tasks: Any, noted: Any, clock: Any, crew: Any, own: Any) -> None:
    """Wait as the clock of the compiled loop of a task, whose control words are ``steering``."""
    steering[loop.PAUSE] = enter(plan, tasks, noted, clock, crew, own)
    if steering[loop.PAUSE] == GO:
        steering[loop.TICK] = crew[HEAD + ROW * own[0] + TICK]


def lock(crew: Any) -> None:
    """Take the mutex."""
    _function(crew[LOCK])(crew[MUTEX])


def unlock(crew: Any) -> None:
    """Give the mutex back."""
    _function(crew[UNLOCK])(crew[MUTEX])


def post(crew: Any, semaphore: int) -> None:
    """Wake the thread that rests at a semaphore, or that will."""
    _function(crew[POST])(semaphore)


def rest(crew: Any, semaphore: int) -> None:
    """Wait at a semaphore; a signal may end it earlier."""
    _function(crew[REST])(semaphore)


@functools.cache
def _function(address: int) -> Callable[[int], int]:
    return ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_int64)(address)


def _machine_lock(crew: Any) -> None:
    system(crew[LOCK], crew[MUTEX], 0, 0, 0)


def _machine_unlock(crew: Any) -> None:
    system(crew[UNLOCK], crew[MUTEX], 0, 0, 0)


def _machine_post(crew: Any, semaphore: int) -> None:
    system(crew[POST], semaphore, 0, 0, 0)


def _machine_rest(crew: Any, semaphore: int) -> None:
    system(crew[REST], semaphore, 0, 0, 0)


# What stands for the four functions in machine code.
MACHINE: Mapping[Any, Any] = {
    lock: _machine_lock, unlock: _machine_unlock, post: _machine_post, rest: _machine_rest,
}  # fmt: skip
GATE = Routine(gate, "wwwwwww", {**clocks.MACHINE, **MACHINE})
HAND_OVER = Routine(hand_over, "www", MACHINE)
