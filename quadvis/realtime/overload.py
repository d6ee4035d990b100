"""Overload: the overruns of each task against its limits, as in xPC Target.

An overrun is a tick of a task at which the task was due and did not run, because a step took too long or the
loop woke too late. Each task has its own count, as each sub-rate in xPC Target.
"""

from __future__ import annotations

from typing import Any

from quadvis.diagram.sections.overload import ACTIONS, SAFE, STOP
from quadvis.native.clock import GO
from quadvis.realtime import control
from quadvis.realtime.grid import first_from
from quadvis.realtime.plan import (
    ACTION,
    AT_ONCE,
    CONSECUTIVE,
    COUNTED,
    EVERY,
    EXCEEDED,
    FOUND,
    HEAD,
    IN_A_ROW,
    IN_ALL,
    LIMIT,
    MAX,
    MISSED,
    OFFSET,
    ROW,
    UNLIMITED,
)  # fmt: skip

# Why a wait pauses: the run is to end; too many overruns end it, or make it safe; a signal has come; a task
# that runs by itself has failed; a measurement of blocks' times begins or is over.
ENDING, OVERLOADED, UNSAFE, SIGNAL, FAULTED, MEASURED = range(1, 7)
STOPS, SAVES = ACTIONS.index(STOP), ACTIONS.index(SAFE)


def missed(plan: Any, shared: Any, task: int, number: int, start: int, starting: int) -> int:
    """Count overruns of a task from tick ``start`` on; return what follows.

    Those that one of the first steps has caused, as ``starting`` says, do not count.
    """
    row = HEAD + ROW * task
    if starting != 0:
        return GO
    plan[row + COUNTED] += number
    plan[row + IN_A_ROW] += number
    if plan[row + COUNTED] > plan[row + MAX]:
        limit, found = IN_ALL, plan[row + COUNTED]
    elif plan[row + CONSECUTIVE] != UNLIMITED and plan[row + IN_A_ROW] > plan[row + CONSECUTIVE]:
        limit, found = AT_ONCE, plan[row + IN_A_ROW]
    else:
        return GO
    stops = plan[row + ACTION] == STOPS
    saves = plan[row + ACTION] == SAVES and shared[control.SAFE] == 0
    if not (stops or saves):
        return GO
    plan[EXCEEDED], plan[LIMIT], plan[FOUND] = task, limit, found
    plan[MISSED] = first_from(plan[row + EVERY], plan[row + OFFSET], start)
    if saves:
        shared[control.SAFE] = 1
        return UNSAFE
    return OVERLOADED


def worse(one: int, other: int) -> int:
    """Return what follows of two things that do."""
    if one == OVERLOADED or other == OVERLOADED:
        return OVERLOADED
    return max(one, other)
