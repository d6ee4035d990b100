"""Events between two ticks: where a function of the states falls to zero, the step is cut in two.

A block in the continuous task says by ``crossing`` how far it is from its event, and by ``event`` what
changes there. If a function that was positive is not so at the end of a step, its zero is sought on the
step's own formula, taken with a part of the step, until it is known to `LOCATED` of a step. The states are
then those on the far side of the zero; the event changes them, what follows from it is computed anew, and the
rest of the step begins there. Two zeros of one function within one step that undo each other are not seen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.layout import TIME
from quadvis.engine.solver import Solver, Vector

if TYPE_CHECKING:
    from quadvis.engine.interpreter import Interpreter

NEVER = -1.0  # a value that never falls to zero
LOCATED = 1e-10  # of a step: an event is known to it
MOST = 100  # events within one step
PARTS = 16  # in which a step is looked at that begins at an event: a function may rise there and fall again
TRIES = 100  # steps of the search

Values = NDArray[np.float64]
Flags = NDArray[np.bool_]


class Chatter(Exception):
    """More events within one step than can be meant, and the number of the block that has them."""

    def __init__(self, block: int) -> None:
        super().__init__(f"more than {MOST} events within one step")
        self.block = block


class EventSolver:
    """Advances the states of an interpreter by one step, from event to event."""

    def __init__(self, interpreter: Interpreter) -> None:
        program = interpreter.program
        self._interpreter, self._memory = interpreter, interpreter.memory
        self._method, self._period = program.solver, float(program.period)
        self._states = np.array(program.states, np.intp)
        self._crossings, self._events = program.crossings, program.events
        self._gates = [program.gate(op.block) for op in self._crossings]
        self._renewed = [interpreter.call(op) for op in program.renewed]
        self._moving = [interpreter.call(op) for op in program.minor]
        self._ends = [0]  # of each block's values, among those of all

    def advance(self, time: float, state: Vector) -> Vector:
        """Return the states one step later; Chatter if too many events come. It writes over the memory."""
        done, count = 0.0, 0
        values = self._values(time, state)
        while True:
            rest = self._period - done
            found = self._first(time + done, state, rest, values)
            if found is None:
                return self._moved(time + done, state, rest)
            taken, fired, armed = found
            state = self._moved(time + done, state, taken)
            done += taken
            while fired.any():
                count += 1
                if count > MOST:
                    raise Chatter(self._blocks(fired)[0])
                state = self._happen(time + done, state, fired)
                values = self._values(time + done, state)
                armed = armed & ~fired
                fired = armed & (values <= 0.0)  # an event may be the cause of another one at once

    def _first(
        self, time: float, state: Vector, rest: float, values: Values
    ) -> tuple[float, Flags, Flags] | None:
        """Return after which time the first event comes, whose it is, and which functions were positive."""
        armed = values > 0.0
        parts = PARTS if rest < self._period or (values == 0.0).any() else 1
        before = 0.0
        for part in range(1, parts + 1):
            after = rest * part / parts
            later = self._values(time + after, self._moved(time, state, after))
            fallen = armed & (later <= 0.0)
            if fallen.any():
                return self._located(time, state, (before, after), armed)
            armed |= later > 0.0
            before = after
        return None

    def _located(
        self, time: float, state: Vector, bracket: tuple[float, float], armed: Flags
    ) -> tuple[float, Flags, Flags]:
        """Return where the least of the armed functions is first found to be zero or below.

        It is sought by the Illinois method, a regula falsi, with a bisection wherever that is slow. Source:
        Dowell and Jarratt, A modified regula falsi method, BIT 11 (1971).
        """

        def least(after: float) -> tuple[float, Values]:
            values = self._values(time + after, self._moved(time, state, after))
            return float(values[armed].min()), values

        low, high = bracket
        weight_low, _ = least(low)
        weight_high, values = least(high)
        for trial in range(TRIES):
            if high - low <= LOCATED * self._period:
                break
            span = weight_low - weight_high
            middle = low + (high - low) * weight_low / span if np.isfinite(span) and span > 0.0 else low
            if trial % 3 == 2 or not low < middle < high:
                middle = (low + high) / 2
            if not low < middle < high:
                break
            found, there = least(middle)
            if found > 0.0:
                low, weight_low, weight_high = middle, found, weight_high / 2
            else:
                high, weight_high, weight_low, values = middle, found, weight_low / 2, there
        return high, armed & (values <= 0.0), armed

    def _moved(self, time: float, state: Vector, after: float) -> Vector:
        """Return the states some time later, by one step of the formula."""
        if after <= 0.0:
            return state
        rates = self._interpreter.rates
        return Solver(self._method, after).advance(rates, time, state, rates(time, state))

    def _place(self, time: float, state: Vector) -> None:
        """Let the memory hold a time, its states, and the signals that move with them."""
        floats = self._memory.floats
        floats[TIME.position] = time
        floats[self._states] = state
        self._interpreter.run_calls(self._moving)

    def _values(self, time: float, state: Vector) -> Values:
        """Return the functions of all blocks, element by element; of one that does not run, no event."""
        self._place(time, state)
        asked = self._interpreter.asked
        found = [np.ravel(np.asarray(asked(op), np.float64)) for op in self._crossings]
        for number, gate in enumerate(self._gates):
            if gate is not None and not self._memory.read(gate):
                found[number] = np.full(found[number].size, NEVER)
        self._ends = np.cumsum([each.size for each in found]).tolist()
        return np.concatenate(found)

    def _blocks(self, fired: Flags) -> list[int]:
        """Return which of the blocks with events have one."""
        begins = [0, *self._ends[:-1]]
        pairs = enumerate(zip(begins, self._ends, strict=True))
        return [self._crossings[number].block for number, (begin, end) in pairs if fired[begin:end].any()]

    def _happen(self, time: float, state: Vector, fired: Flags) -> Vector:
        """Let the events happen, compute anew what follows from them, and return the states."""
        self._place(time, state)
        blocks = self._blocks(fired)
        self._interpreter.run_calls(
            [self._interpreter.call(op) for op in self._events if op.block in blocks] + self._renewed
        )
        return self._memory.floats[self._states]
