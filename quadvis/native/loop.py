"""The compiled loop: it runs any program, from tables of whole numbers, over the memory of the engine.

The source is Python and is compiled once, as a `Routine`. The loop returns to its caller for what only
Python can do: the call of a block that is not compiled, a full ring of rows, a fault, the end. The caller
does it and calls again; the loop continues where it was.

Where a clock is given, the loop calls it before each tick. A clock is machine code too: it waits, and may
move the loop to a later tick, or pause it; see `quadvis.native.clock`.

An instruction has two numbers: what to do, and an operand. Instructions stand in the order of the
interpreter's tick. A segment is a run of instructions with one rhythm: at ticks at which the rhythm is not
due, the loop leaves the segment out.
"""

from __future__ import annotations

from typing import Any

from quadvis.native.foreign import invoke

WIDTH = 2
# Instructions. A larger number is the address of a function to call; its operand is that of its places. The
# operand of the others is a place in ``operands``, where the numbers stand that are named here.
COPY = 0  # how many slots; for each, the slot to read and the slot to write
CHECK = 1  # first slot, number of slots: these must be finite
ROW = 2  # number of the tap, first slot, number of slots
MOVE = 3  # first slot to read, first slot to write, number of slots; the two do not overlap
INTEGRATE = 4
GATE = 5  # slot, number of instructions, number of slots, these slots: unless the first slot is true, the
# instructions that follow are left out, and the other slots become zero
PYTHON = 6  # what only Python can do; the operand itself is its number

# Why the loop returned.
DONE, FAILED, NOT_FINITE, FULL, ASKED, PAUSED = range(6)

# The places in ``control``.
TICK, UNTIL, SEGMENT, PLACE, RESULT, RHYTHMS, SEGMENTS, NUMERATOR, DENOMINATOR = range(9)
STATES, HELD, STAGES, MINOR, DERIVATIVES, CALLS = range(9, 15)
CLOCK, CLOCK_PLACES, PAUSE = range(
    15, 18
)  # a clock's address, or 0; that of its places; by it: why it pauses
LEFT, LEFT_END = range(18, 20)  # segments that are left out from now on
TIME = 20  # the place of time in memory
CONTROLS = 21

POINTERS = "wwwwwwrwwwwrr"  # of `loop`: to whole or real numbers


def loop(
    control: Any, rhythms: Any, due: Any, segments: Any, code: Any, operands: Any, memory: Any, words: Any,
    taps: Any, ring: Any, places: Any, stages: Any, scratch: Any,
) -> None:  # fmt: skip
    """Run ticks until control[UNTIL], or until something is asked of the caller: control[RESULT].

    ``rhythms``: ticks from one time to the next, and ticks to the next time. ``memory`` and ``words`` are the
    engine's slots as floats and as whole numbers. ``taps``: place in ``ring``, room in rows, rows there.
    ``places``: each state's slot and that of its slope, then the slots that minor steps write over.
    ``stages``: the node of each stage in s, then the two weights of its slope times the step, for the next
    stage and for the result.
    """
    tick, segment, place = control[TICK], control[SEGMENT], control[PLACE]
    result = DONE
    while tick < control[UNTIL]:
        if segment < 0:
            control[TICK] = tick
            if control[CLOCK] != 0:
                invoke(control[CLOCK], control[CLOCK_PLACES])
                if control[PAUSE] != 0:
                    control[SEGMENT], control[RESULT] = -1, PAUSED
                    return
                _pass(rhythms, control[RHYTHMS], control[TICK] - tick)
                tick = control[TICK]
                if tick >= control[UNTIL]:
                    break
            segment = place = 0
            _begin(control, tick, rhythms, due, memory)
        while segment < control[SEGMENTS]:
            if due[segments[3 * segment]] and not control[LEFT] <= segment < control[LEFT_END]:
                place = max(place, segments[3 * segment + 1])
                end = segments[3 * segment + 2]
                while place < end:
                    place = _call(code, place, end)
                    if place == end:
                        break
                    kind, operand = code[WIDTH * place], code[WIDTH * place + 1]
                    if kind > PYTHON:
                        result = FAILED
                    elif kind == COPY:
                        _copy(operands, operand, words)
                    elif kind == CHECK:
                        if not _finite(memory, operands[operand], operands[operand + 1]):
                            result = NOT_FINITE
                    elif kind == ROW:
                        result = _row(tick, operands, operand, words, taps, ring)
                    elif kind == MOVE:
                        _move(words, operands[operand], operands[operand + 1], operands[operand + 2])
                    elif kind == GATE:
                        place += _left_out(operands, operand, words)
                    elif kind == INTEGRATE:
                        result = _integrate(control, code, operands, memory, words, places, stages, scratch)
                    else:
                        result = ASKED
                    if result != DONE:
                        control[TICK], control[SEGMENT], control[PLACE] = tick, segment, place
                        control[RESULT] = result
                        return
                    place += 1
            segment += 1
            place = 0
        segment = -1
        tick += 1
    control[TICK], control[SEGMENT], control[PLACE] = tick, segment, place
    control[RESULT] = DONE


def _begin(control: Any, tick: int, rhythms: Any, due: Any, memory: Any) -> None:
    """Begin a tick: what is due, and the time."""
    for index in range(control[RHYTHMS]):
        waiting = rhythms[2 * index + 1]
        due[index] = waiting == 0
        rhythms[2 * index + 1] = (rhythms[2 * index] if waiting == 0 else waiting) - 1
    # Both are exact as floats, so that the quotient is rounded once, as in the interpreter.
    memory[control[TIME]] = (tick * control[NUMERATOR]) / control[DENOMINATOR]


def _pass(rhythms: Any, count: int, ticks: int) -> None:
    """Leave ticks out: advance what each rhythm waits."""
    for index in range(count):
        waiting = rhythms[2 * index + 1] - ticks
        rhythms[2 * index + 1] = waiting if waiting >= 0 else waiting % rhythms[2 * index]


def _call(code: Any, place: int, end: int) -> int:
    """Call functions one after the other; return the place of what is no call, or of the call that failed."""
    while place < end:
        address = code[WIDTH * place]
        if address <= PYTHON or invoke(address, code[WIDTH * place + 1]) != 0:
            break
        place += 1
    return place


def called(code: Any, place: int, end: int, operands: Any, words: Any) -> bool:
    """Call functions one after the other, but none behind a gate that is shut; return whether none failed."""
    place = _call(code, place, end)
    while place < end and code[WIDTH * place] == GATE:
        place += 1 + _left_out(operands, code[WIDTH * place + 1], words)
        place = _call(code, place, end)
    return place == end


def _left_out(operands: Any, at: int, words: Any) -> int:
    """Return how many instructions a gate leaves out."""
    if words[operands[at]] != 0:
        return 0
    for index in range(at + 3, at + 3 + operands[at + 2]):
        words[operands[index]] = 0
    return int(operands[at + 1])


def _copy(operands: Any, at: int, words: Any) -> None:
    """Copy slots, one after the other."""
    for index in range(at + 1, at + 1 + 2 * operands[at], 2):
        words[operands[index + 1]] = words[operands[index]]


def _move(words: Any, source: int, target: int, count: int) -> None:
    """Copy neighbours."""
    for index in range(count):
        words[target + index] = words[source + index]


def _finite(memory: Any, first: int, count: int) -> bool:
    """Return whether neighbours hold finite numbers: the difference of others to themselves is NaN."""
    strange = False
    for index in range(first, first + count):
        strange |= memory[index] - memory[index] != 0.0
    return not strange


def _row(tick: int, operands: Any, at: int, words: Any, taps: Any, ring: Any) -> int:
    """Put a row and its tick into the ring of a tap."""
    tap, first, size = 3 * operands[at], operands[at + 1], operands[at + 2]
    if taps[tap + 2] == taps[tap + 1]:
        return FULL
    start = taps[tap] + taps[tap + 2] * (size + 1)
    ring[start] = tick
    for index in range(size):
        ring[start + 1 + index] = words[first + index]
    taps[tap + 2] += 1
    return DONE


def _integrate(
    control: Any, code: Any, operands: Any, memory: Any, words: Any, places: Any, stages: Any, scratch: Any
) -> int:
    """Carry the states over one step as `solver.Solver` does; if a call fails, leave memory as it was.

    Of the slopes of all stages the sum alone is kept, added up in the solver's order.
    """
    count, held, last = control[STATES], control[HELD], control[STAGES]
    sums, kept = count, 2 * count  # in ``scratch``, behind the states at the begin
    time = memory[0]
    for index in range(held):
        scratch[kept + index] = memory[places[2 * count + index]]
    for index in range(count):
        scratch[index] = scratch[sums + index] = memory[places[2 * index]]
    result = DONE
    for stage in range(last):
        first = control[DERIVATIVES]
        if stage > 0:
            memory[0] = time + stages[3 * stage]
            first = control[MINOR]
        if not called(code, first, control[CALLS], operands, words):
            result = FAILED
            break
        onward, weight = stages[3 * stage + 1], stages[3 * stage + 2]
        for index in range(count):
            slope = memory[places[2 * index + 1]]
            memory[places[2 * index]] = scratch[index] + onward * slope
            scratch[sums + index] += weight * slope
    if result == DONE and not _finite(scratch, sums, count):
        result = FAILED
    memory[0] = time
    for index in range(held):
        memory[places[2 * count + index]] = scratch[kept + index]
    final = sums if result == DONE else 0
    for index in range(count):
        memory[places[2 * index]] = scratch[final + index]
    return result
