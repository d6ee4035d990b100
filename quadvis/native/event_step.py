"""The solver's step with events, as machine code: what `quadvis.engine.events` does, number by number.

The loop calls it as it calls a block. If anything fails, memory is as it was before the step, and the
interpreter does the step again.
"""

from __future__ import annotations

from typing import Any, NamedTuple

from quadvis.engine.events import LOCATED, MOST, NEVER, PARTS, TRIES
from quadvis.native.loop import called
from quadvis.native.routine import Routine

# The places in ``plan``: numbers of states, of slots that are held, of stages, of blocks with events, of
# values; the first instructions of each kind; then `WIDTH` numbers for each block with events.
STATES, HELD, STAGES, BLOCKS, VALUES = range(5)
MINOR, DERIVATIVES, CROSSINGS, EVENTS, RENEWED, END = range(5, 11)
FIRST = 11
# First value, number of values; the slot that is true when the block runs, or -1; first instruction of its
# event, and the first behind it; first slot of its record, number of slots.
BEGIN, COUNT, GATE, EVENT, EVENT_END, RECORD, SIZE = range(7)
WIDTH = 7


class EventArrays(NamedTuple):
    """What one step works on, in the order of `event_step`."""

    plan: Any
    code: Any
    operands: Any
    memory: Any  # slots as floats
    words: Any  # the same as whole numbers
    places: Any  # each state's slot and that of its slope, then the slots that are held
    formula: Any  # the period (s); for each stage its node, and two weights of its slope, in steps
    state: Any
    moved: Any  # states some time later
    first: Any  # states at the begin
    held: Any  # slots at the begin
    present: Any  # values of all functions now,
    found: Any  # as they were last asked for,
    above: Any  # and at the upper end of a search
    armed: Any  # which were positive
    fired: Any  # which have fallen to zero
    saved: Any  # records of the blocks with events at the begin


POINTERS = "wwwrwwrrrrrrrrwww"  # of `event_step`: to whole or real numbers


def event_step(
    plan: Any, code: Any, operands: Any, memory: Any, words: Any, places: Any, formula: Any, state: Any,
    moved: Any, first: Any, held: Any, present: Any, found: Any, above: Any, armed: Any, fired: Any,
    saved: Any,
) -> None:  # fmt: skip
    """Advance the states by one step, from event to event; ArithmeticError if that fails."""
    step = EventArrays(
        plan, code, operands, memory, words, places, formula, state, moved, first, held, present, found,
        above, armed, fired, saved,
    )  # fmt: skip
    begin = memory[0]
    _keep(step)
    arrived = _advance(step, begin)
    _settle(step, begin, arrived)
    if not arrived:
        raise ArithmeticError


EVENT_STEP = Routine(event_step, POINTERS)


def _keep(step: EventArrays) -> None:
    """Keep what a failure must leave as it was, and what is held."""
    count = step.plan[STATES]
    for index in range(count):
        step.state[index] = step.first[index] = step.memory[step.places[2 * index]]
    for index in range(step.plan[HELD]):
        step.held[index] = step.memory[step.places[2 * count + index]]
    kept = 0
    for block in range(step.plan[BLOCKS]):
        at = FIRST + WIDTH * block
        for index in range(step.plan[at + RECORD], step.plan[at + RECORD] + step.plan[at + SIZE]):
            step.saved[kept] = step.words[index]
            kept += 1


def _settle(step: EventArrays, begin: float, arrived: bool) -> None:
    """Let memory hold what is held, and the states: the new ones, or those that were kept."""
    count = step.plan[STATES]
    if not arrived:
        kept = 0
        for block in range(step.plan[BLOCKS]):
            at = FIRST + WIDTH * block
            for index in range(step.plan[at + RECORD], step.plan[at + RECORD] + step.plan[at + SIZE]):
                step.words[index] = step.saved[kept]
                kept += 1
    for index in range(step.plan[HELD]):
        step.memory[step.places[2 * count + index]] = step.held[index]
    step.memory[0] = begin
    for index in range(count):
        step.memory[step.places[2 * index]] = step.state[index] if arrived else step.first[index]


def _advance(step: EventArrays, time: float) -> bool:
    """Advance ``state`` by one step; return whether nothing failed and the states are finite."""
    period, done, happened = step.formula[0], 0.0, 0
    if not _ask(step, time, step.state):
        return False
    _take(step, step.present)
    while True:
        rest = period - done
        taken = _first_event(step, time + done, rest)
        if taken < 0.0:  # it has failed
            return False
        if not _move(step, time + done, min(taken, rest)):
            return False
        for index in range(step.plan[STATES]):
            step.state[index] = step.moved[index]
        if taken > rest:
            return _is_finite(step)
        done += taken
        while _any_fired(step):
            happened += 1
            if happened > MOST or not _happen(step, time + done) or not _ask(step, time + done, step.state):
                return False
            _take(step, step.present)
            for index in range(step.plan[VALUES]):
                step.armed[index] = step.armed[index] != 0 and step.fired[index] == 0
                step.fired[index] = step.armed[index] != 0 and step.present[index] <= 0.0


def _first_event(step: EventArrays, time: float, rest: float) -> float:
    """Return after which time the first event comes; more than ``rest`` if none does, -1 for a failure."""
    any_zero = False
    for index in range(step.plan[VALUES]):
        step.armed[index] = step.present[index] > 0.0
        any_zero |= step.present[index] == 0.0
    parts = PARTS if rest < step.formula[0] or any_zero else 1
    before = 0.0
    for part in range(1, parts + 1):
        after = rest * part / parts
        if not _look(step, time, after):
            return -1.0
        fallen = False
        for index in range(step.plan[VALUES]):
            fallen |= step.armed[index] != 0 and step.found[index] <= 0.0
        if fallen:
            return _locate(step, time, before, after)
        for index in range(step.plan[VALUES]):
            if step.found[index] > 0.0:
                step.armed[index] = 1
        before = after
    return 2.0 * rest + 1.0


def _locate(step: EventArrays, time: float, low: float, high: float) -> float:
    """Return where the least of the armed functions is first found to be zero or below; -1 for a failure.

    It is `EventSolver._located`.
    """
    if not _look(step, time, low):
        return -1.0
    weight_low = _least(step)
    if not _look(step, time, high):
        return -1.0
    weight_high = _least(step)
    _take(step, step.above)
    for trial in range(TRIES):
        if high - low <= LOCATED * step.formula[0]:
            break
        span = weight_low - weight_high
        middle = low
        if span - span == 0.0 and span > 0.0:  # it is finite
            middle = low + (high - low) * weight_low / span
        if trial % 3 == 2 or not low < middle < high:
            middle = (low + high) / 2
        if not low < middle < high:
            break
        if not _look(step, time, middle):
            return -1.0
        found = _least(step)
        if found > 0.0:
            low, weight_low, weight_high = middle, found, weight_high / 2
        else:
            high, weight_high, weight_low = middle, found, weight_low / 2
            _take(step, step.above)
    for index in range(step.plan[VALUES]):
        step.fired[index] = step.armed[index] != 0 and step.above[index] <= 0.0
    return high


def _least(step: EventArrays) -> float:
    """Return the least of the armed functions as they were last asked for; NaN if one is NaN."""
    least, empty = 0.0, True
    for index in range(step.plan[VALUES]):
        value = step.found[index]
        if step.armed[index] != 0 and (empty or value < least or value != value):
            least, empty = value, False
    return least


def _look(step: EventArrays, time: float, after: float) -> bool:
    """Ask for the functions some time later; return whether nothing failed."""
    return _move(step, time, after) and _ask(step, time + after, step.moved)


def _move(step: EventArrays, time: float, after: float) -> bool:
    """Let ``moved`` hold the states some time later, by one step of the formula; return whether it did."""
    count, stages = step.plan[STATES], step.plan[STAGES]
    for index in range(count):
        step.moved[index] = step.state[index]
    if after <= 0.0:
        return True
    for index in range(count):
        step.memory[step.places[2 * index]] = step.state[index]
    for stage in range(stages):
        at = 1 + 3 * stage
        step.memory[0] = time + step.formula[at] * after if stage > 0 else time
        if not called(step.code, step.plan[MINOR], step.plan[CROSSINGS], step.operands, step.words):
            return False
        onward, weight = step.formula[at + 1] * after, step.formula[at + 2] * after
        for index in range(count):
            slope = step.memory[step.places[2 * index + 1]]
            step.memory[step.places[2 * index]] = step.state[index] + onward * slope
            step.moved[index] += weight * slope
    return True


def _place(step: EventArrays, time: float, state: Any) -> bool:
    """Let the memory hold a time, its states, and the signals that move with them."""
    step.memory[0] = time
    for index in range(step.plan[STATES]):
        step.memory[step.places[2 * index]] = state[index]
    return called(step.code, step.plan[MINOR], step.plan[DERIVATIVES], step.operands, step.words)


def _ask(step: EventArrays, time: float, state: Any) -> bool:
    """Let ``found`` hold the functions of all blocks; of one that does not run, no event."""
    if not _place(step, time, state):
        return False
    if not called(step.code, step.plan[CROSSINGS], step.plan[EVENTS], step.operands, step.words):
        return False
    for block in range(step.plan[BLOCKS]):
        at = FIRST + WIDTH * block
        if step.plan[at + GATE] >= 0 and step.words[step.plan[at + GATE]] == 0:
            for index in range(step.plan[at + BEGIN], step.plan[at + BEGIN] + step.plan[at + COUNT]):
                step.found[index] = NEVER
    return True


def _take(step: EventArrays, target: Any) -> None:
    """Copy the functions as they were last asked for."""
    for index in range(step.plan[VALUES]):
        target[index] = step.found[index]


def _any_fired(step: EventArrays) -> bool:
    """Return whether a function has fallen to zero."""
    fired = False
    for index in range(step.plan[VALUES]):
        fired |= step.fired[index] != 0
    return fired


def _happen(step: EventArrays, time: float) -> bool:
    """Let the events happen, and compute anew what follows from them; return whether nothing failed."""
    if not _place(step, time, step.state):
        return False
    for block in range(step.plan[BLOCKS]):
        at = FIRST + WIDTH * block
        fired = False
        for index in range(step.plan[at + BEGIN], step.plan[at + BEGIN] + step.plan[at + COUNT]):
            fired |= step.fired[index] != 0
        first, end = step.plan[at + EVENT], step.plan[at + EVENT_END]
        if fired and not called(step.code, first, end, step.operands, step.words):
            return False
    if not called(step.code, step.plan[RENEWED], step.plan[END], step.operands, step.words):
        return False
    for index in range(step.plan[STATES]):
        step.state[index] = step.memory[step.places[2 * index]]
    return True


def _is_finite(step: EventArrays) -> bool:
    """Return whether all states are finite: the difference of others to themselves is NaN."""
    strange = False
    for index in range(step.plan[STATES]):
        strange |= step.state[index] - step.state[index] != 0.0
    return not strange
