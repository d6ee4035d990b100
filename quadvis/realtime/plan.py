"""The plan of a loop: the schedule, the limits and the state of its pacer, as whole numbers.

They are those of one loop and no other process reads them. As numbers they serve the interpreted and the
compiled pacer alike, see `quadvis.realtime.pacing`.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from quadvis.diagram.sections.overload import ACTIONS, OverloadLimits
from quadvis.realtime.notes import times_starts
from quadvis.realtime.schedule import Schedule
from quadvis.realtime.words import whole_words

# Words of the head: what is given. The time of a tick in ns: whole ones, and a part of one.
WHOLE, REST, DENOMINATOR, TASKS = range(4)
OWN = 4  # how many tasks run in the loop itself: all, or the first
# What the pacer keeps: a step is running; its tick, its begin, its lateness; the end of the last step.
STEPPING, TICK, BEGUN, LATE, ENDED = range(5, 10)
# The tick for which the loop waits, or -1; the tick up to which overruns are counted; the present instant.
WAITING, COUNTED_TO, INSTANT = range(10, 13)
STARTING = 13  # the last step was one of the first
# An overrun too many: its task, which limit, how many there were, the tick.
EXCEEDED, LIMIT, FOUND, MISSED = range(14, 18)
TAKEN = 18  # the number of the group of parameters that was taken last
MEASUREMENT = 19  # the number of the measurement that has begun or ended last
HEAD = 20

# Words of a task's row: what is given, and what the pacer keeps.
EVERY, OFFSET, MAX, CONSECUTIVE, STARTUP, ACTION = range(6)
DUE, COUNTED, IN_A_ROW = range(6, 9)
NOTED, NOTES_ROOM = range(9, 11)  # where the ring of its times begins among the notes, and its room
ROW = 11

UNLIMITED = -1
IN_ALL, AT_ONCE = range(2)  # limits


def make_plan(
    schedule: Schedule, limits: Sequence[OverloadLimits], rooms: Sequence[int], own: int | None = None
) -> Any:
    """Return the plan of a loop that has not begun; ``limits`` are those of each task.

    ``rooms`` has for how many steps of each task the notes have room. The first ``own`` tasks run in the loop
    itself, or all.
    """
    plan = whole_words(HEAD + ROW * len(schedule.rhythms))
    plan[WHOLE], rest = divmod(schedule.numerator, schedule.denominator)
    plan[REST], plan[DENOMINATOR] = rest, schedule.denominator
    plan[TASKS] = len(schedule.rhythms)
    plan[OWN] = len(schedule.rhythms) if own is None else own
    plan[WAITING], plan[STARTING], plan[EXCEEDED] = -1, 1, -1
    for number, (rhythm, limit) in enumerate(zip(schedule.rhythms, limits, strict=True)):
        row = HEAD + ROW * number
        plan[row + EVERY], plan[row + OFFSET] = rhythm
        plan[row + MAX], plan[row + STARTUP] = limit.max, limit.startup
        plan[row + CONSECUTIVE] = UNLIMITED if limit.consecutive is None else limit.consecutive
        plan[row + ACTION] = ACTIONS.index(limit.action)
        plan[row + NOTED], plan[row + NOTES_ROOM] = times_starts(rooms)[number], rooms[number]
    return plan
