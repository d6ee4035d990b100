"""Deadlines of ticks, and the ticks at which tasks are due, from the words of a `plan`.

All is done in whole numbers by plain functions, which numba compiles, too. Instants are nanoseconds since the
start.
"""

from __future__ import annotations

from typing import Any

from quadvis.realtime.plan import DENOMINATOR, EVERY, HEAD, OFFSET, REST, ROW, TASKS, WHOLE


def deadline(plan: Any, tick: int) -> int:
    """Return the instant at which a tick is due."""
    instant: int = tick * plan[WHOLE] + tick * plan[REST] // plan[DENOMINATOR]
    return instant


def following(plan: Any, tick: int, instant: int) -> int:
    """Return the first tick with a due task, from ``tick`` on and due no earlier than an instant."""
    if deadline(plan, tick) < instant:
        tick = _not_before(plan, instant)
    found = -1
    for row in range(HEAD, HEAD + ROW * plan[TASKS], ROW):
        first = first_from(plan[row + EVERY], plan[row + OFFSET], tick)
        if found < 0 or first < found:
            found = first
    return found


def latest(plan: Any, instant: int) -> int:
    """Return the last tick with a due task that is due up to an instant; -1 if there is none."""
    tick = _not_before(plan, instant + 1) - 1
    found = -1
    for row in range(HEAD, HEAD + ROW * plan[TASKS], ROW):
        every, offset = plan[row + EVERY], plan[row + OFFSET]
        if tick >= offset:
            found = max(found, tick - (tick - offset) % every)
    return found


def due_in(every: int, offset: int, start: int, stop: int) -> int:
    """Return how many ticks of a rhythm lie in ``range(start, stop)``."""
    return max(0, -((offset - stop) // every)) - max(0, -((offset - start) // every))


def first_from(every: int, offset: int, tick: int) -> int:
    """Return the first tick of a rhythm from a tick on."""
    return tick + max(offset - tick, (offset - tick) % every)


def _not_before(plan: Any, instant: int) -> int:
    """Return the first tick that is due no earlier than an instant: a guess as a float, then exactly."""
    tick = max(0, int(instant / (plan[WHOLE] + plan[REST] / plan[DENOMINATOR])))
    while deadline(plan, tick) < instant:
        tick += 1
    while tick > 0 and deadline(plan, tick - 1) >= instant:
        tick -= 1
    return tick
