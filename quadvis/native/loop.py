"""The compiled loop: it runs any program, from tables of whole numbers, over the memory of the engine.

The source is Python and is compiled once, by `compile_loop`. The loop returns to its caller for what only
Python can do: the call of a block that is not compiled, a full ring of rows, a fault, the end. The caller
does it and calls again; the loop continues where it was.

An instruction has ``WIDTH`` numbers: what to do, and up to four operands. Instructions stand in the order of
the interpreter's tick. A segment is a run of instructions with one rhythm: at ticks at which the rhythm is
not due, the loop leaves the segment out.
"""

from __future__ import annotations

import math
import types
from typing import Any

from quadvis.native.compiler import OPTIONS, compile_function
from quadvis.native.machine_code import Compiled

WIDTH = 5
# Instructions, and their operands.
CALL = 0  # address of a function, address of its places
COPY = 1  # first slot to read, first slot to write, number of slots
CHECK = 2  # first slot, number of slots: these must be finite
ROW = 3  # number of the tap, first slot, number of slots
PYTHON = 4  # what only Python can do, by its number
INTEGRATE = 5  # nothing

# Why the loop returned.
DONE, FAILED, NOT_FINITE, FULL, ASKED = range(5)

# The places in ``control``.
TICK, UNTIL, SEGMENT, PLACE, RESULT, RHYTHMS, SEGMENTS, NUMERATOR, DENOMINATOR = range(9)
STATES, HELD, STAGES, MINOR, MINORS, DERIVATIVES, DERIVATIVE_COUNT = range(9, 16)
CONTROLS = 16

SYMBOL = "quadvis_loop"


def loop(
    control: Any, rhythms: Any, due: Any, segments: Any, code: Any, memory: Any, words: Any,
    taps: Any, ring: Any, places: Any, stages: Any, scratch: Any,
) -> None:  # fmt: skip
    """Run ticks until control[UNTIL], or until something is asked of the caller: control[RESULT].

    ``rhythms``: ticks from one time to the next, and ticks to the next time. ``memory`` and ``words`` are the
    engine's slots as floats and as whole numbers. ``taps``: place in ``ring``, room in rows, rows there.
    ``places`` are the slots of the states, then those of the slopes. ``stages``: the node of each stage in s,
    then its weights times the step; the last row has the weights of the result.
    """
    while control[TICK] < control[UNTIL]:
        if control[SEGMENT] < 0:
            _begin(control, rhythms, due, memory)
        while control[SEGMENT] < control[SEGMENTS]:
            segment = 3 * control[SEGMENT]
            if due[segments[segment]]:
                place = max(control[PLACE], segments[segment + 1])
                while place < segments[segment + 2]:
                    result = _do(
                        control, code, WIDTH * place, memory, words, taps, ring, places, stages, scratch
                    )
                    if result != DONE:
                        control[PLACE] = place
                        control[RESULT] = result
                        return
                    place += 1
            control[SEGMENT] += 1
            control[PLACE] = 0
        control[SEGMENT] = -1
        control[TICK] += 1
    control[RESULT] = DONE


def _begin(control: Any, rhythms: Any, due: Any, memory: Any) -> None:
    """Begin a tick: what is due, and the time."""
    control[SEGMENT] = 0
    control[PLACE] = 0
    for index in range(control[RHYTHMS]):
        waiting = rhythms[2 * index + 1]
        due[index] = waiting == 0
        rhythms[2 * index + 1] = (rhythms[2 * index] if waiting == 0 else waiting) - 1
    # Both are exact as floats, so that the quotient is rounded once, as in the interpreter.
    memory[0] = (control[TICK] * control[NUMERATOR]) / control[DENOMINATOR]


def _do(
    control: Any, code: Any, at: int, memory: Any, words: Any, taps: Any, ring: Any, places: Any,
    stages: Any, scratch: Any,
) -> int:  # fmt: skip
    """Do one instruction; return what is asked of the caller, or DONE."""
    kind = code[at]
    if kind == CALL:
        return FAILED if invoke(code[at + 1], code[at + 2]) != 0 else DONE
    if kind == COPY:
        for index in range(code[at + 3]):
            words[code[at + 2] + index] = words[code[at + 1] + index]
        return DONE
    if kind == CHECK:
        total = 0.0
        for index in range(code[at + 1], code[at + 1] + code[at + 2]):
            total += 0.0 * memory[index]
        return DONE if total == 0.0 else NOT_FINITE
    if kind == ROW:
        return _row(control, code, at, words, taps, ring)
    if kind == INTEGRATE:
        return _integrate(control, code, memory, places, stages, scratch)
    return ASKED


def _row(control: Any, code: Any, at: int, words: Any, taps: Any, ring: Any) -> int:
    """Put a row and its tick into the ring of a tap."""
    tap, size = 3 * code[at + 1], code[at + 3]
    if taps[tap + 2] == taps[tap + 1]:
        return FULL
    start = taps[tap] + taps[tap + 2] * (size + 1)
    ring[start] = control[TICK]
    for index in range(size):
        ring[start + 1 + index] = words[code[at + 2] + index]
    taps[tap + 2] += 1
    return DONE


def _integrate(control: Any, code: Any, memory: Any, places: Any, stages: Any, scratch: Any) -> int:
    """Carry the states over one step as `solver.Solver` does; if a call fails, leave memory as it was."""
    count, held, last = control[STATES], control[HELD], control[STAGES]
    width = last + 1
    time = memory[0]
    for index in range(held):
        scratch[index] = memory[index]
    for index in range(count):
        scratch[held + index] = memory[places[index]]
    begun, moved = held, held + count
    result = DONE
    stage = 0
    while stage < last and result == DONE:
        if stage > 0:
            memory[0] = time + stages[stage * width]
            _move(count, stage, width, stages, scratch, begun, moved)
            for index in range(count):
                memory[places[index]] = scratch[moved + index]
            result = _calls(code, control[MINOR], control[MINORS])
        if result == DONE:
            result = _calls(code, control[DERIVATIVES], control[DERIVATIVE_COUNT])
        for index in range(count):
            scratch[moved + (1 + stage) * count + index] = memory[places[count + index]]
        stage += 1
    total = 0.0
    if result == DONE:
        _move(count, last, width, stages, scratch, begun, moved)
        for index in range(count):
            total += 0.0 * scratch[moved + index]
    if total != 0.0:
        result = FAILED
    for index in range(held):
        memory[index] = scratch[index]
    final = moved if result == DONE else begun
    for index in range(count):
        memory[places[index]] = scratch[final + index]
    return result


def _move(count: int, stage: int, width: int, stages: Any, scratch: Any, begun: int, moved: int) -> None:
    """Add the weighted slopes of the stages before to the states at the begin."""
    for index in range(count):
        value = scratch[begun + index]
        for before in range(stage):
            weight = stages[stage * width + 1 + before]
            if weight != 0.0:
                value = value + weight * scratch[moved + (1 + before) * count + index]
        scratch[moved + index] = value


def _calls(code: Any, first: int, count: int) -> int:
    """Run calls that belong to no tick of their own."""
    for index in range(first, first + count):
        at = WIDTH * index
        if code[at] != CALL or invoke(code[at + 1], code[at + 2]) != 0:
            return FAILED
    return DONE


def invoke(address: int, places: int) -> int:
    """Call the machine code at an address; `compile_loop` has the compiled form."""
    raise NotImplementedError


def compile_loop() -> Compiled:
    """Compile the loop, with numba."""
    import numba

    kinds: Any = numba.types
    scope = {**globals(), "math": math, "invoke": _invoke()}
    for function in (_begin, _row, _move, _calls, _integrate, _do, loop):
        made = types.FunctionType(function.__code__, scope, function.__name__)
        scope[function.__name__] = numba.njit(made, error_model="numpy")
    whole, real = kinds.CPointer(kinds.int64), kinds.CPointer(kinds.float64)
    pointers = [whole, whole, whole, whole, whole, real, whole, whole, whole, whole, real, real]
    return compile_function(scope["loop"].py_func, pointers, {**OPTIONS, "error_model": "numpy"})


def _invoke() -> Any:
    """Return the function that calls an address, for compiled code."""
    from llvmlite import ir
    from numba import types as kinds
    from numba.extending import intrinsic

    @intrinsic
    def invoke(context: Any, address: Any, places: Any) -> Any:
        def emit(_: Any, builder: Any, __: Any, values: Any) -> Any:
            pointer = ir.IntType(8).as_pointer()
            form = ir.FunctionType(ir.IntType(32), [pointer])
            function = builder.inttoptr(values[0], form.as_pointer())
            return builder.call(function, [builder.inttoptr(values[1], pointer)])

        return kinds.int32(address, places), emit

    return invoke
