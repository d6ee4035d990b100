"""Implicit and variable-step solvers: scipy's, between the ticks at which a sampled block may change things.

A solver takes its own steps up to the next tick of a task that is not continuous; between them it is
interpolated. At a tick at which anything has changed that the derivatives read (a sampled signal, a
parameter, a state that an update or a reset has set) it begins anew. So no step goes across a change.
Where a continuous block reads the time, no step is longer than the distance of two ticks: at rest a solver
takes ever longer ones, and would not see a bump of the road.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.layout import TIME
from quadvis.engine.program import Op, Program
from quadvis.engine.solver import Rates, Vector

if TYPE_CHECKING:
    from quadvis.engine.memory import Memory

FAR = 1e12  # s, where no sampled task bounds the steps
ONCE = ("LSODA",)  # solvers that cannot be told of a later bound


class NoStep(Exception):
    """A solver that cannot go on, and why."""


class VariableSolver:
    """Advances the states of a program from tick to tick, over a memory."""

    def __init__(self, program: Program, memory: Memory) -> None:
        self._program, self._memory = program, memory
        self._states = np.array(program.states, np.intp)
        self._watched = _watched(program)
        self._longest = float(program.period) if _is_timed(program) else math.inf
        self._rhythms = [(task.every, task.offset) for task in program.tasks if not task.continuous]
        self._solver: Any = None
        self._between: Callable[[float], Vector] | None = None  # the interpolant of the last step
        self._due = -1  # the tick at which the solver may go on
        self._seen: NDArray[np.int64] = np.zeros(0, np.int64)
        self._left: Vector = np.zeros(0)

    def restart(self) -> None:
        """Begin anew at the next tick, whatever has changed."""
        self._solver = None

    def advance(self, rates: Rates, tick: int) -> Vector:
        """Return the states at the next tick, and write over the memory; NoStep if it cannot go on."""
        words = self._memory.floats.view(np.int64)
        seen, state = words[self._watched], self._memory.floats[self._states]
        bound = self._bound(tick)
        whole = self._due == tick and np.array_equal(seen, self._seen) and np.array_equal(state, self._left)
        ended = self._solver is not None and self._solver.t_bound <= self._time(tick)
        if self._solver is None or not whole or (ended and self._program.solver in ONCE):
            self._solver = self._made(rates, self._time(tick), state, bound)
        elif ended:
            self._solver.t_bound, self._solver.status = bound, "running"
        self._due, self._seen = tick + 1, seen
        self._left = self._reached(self._time(tick + 1))
        return self._left.copy()

    def _time(self, tick: int) -> float:
        numerator, denominator = self._program.period.as_integer_ratio()
        return tick * numerator / denominator

    def _bound(self, tick: int) -> float:
        """Return the time of the next tick of a sampled task."""
        following = [
            offset if tick < offset else tick + every - (tick - offset) % every
            for every, offset in self._rhythms
        ]
        return self._time(min(following)) if following else FAR

    def _made(self, rates: Rates, time: float, state: Vector, bound: float) -> Any:
        from scipy import integrate

        self._between = None
        made = getattr(integrate, self._program.solver)
        rtol, atol = self._program.tolerances
        try:
            options = {"rtol": rtol, "atol": atol, "max_step": self._longest}
            return made(lambda t, x: rates(float(t), x), time, state, bound, **options)
        except ValueError as error:  # a slope is not finite
            raise NoStep(str(error)) from error

    def _reached(self, time: float) -> Vector:
        """Return the states at a time that is not beyond the bound."""
        solver = self._solver
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # what failed is said by the status
            while solver.t < time:
                try:
                    reason = solver.step()
                except (ValueError, ArithmeticError, np.linalg.LinAlgError) as error:  # of numbers gone wild
                    raise NoStep(str(error)) from error
                self._between = None
                if solver.status == "failed":
                    raise NoStep(reason or "no step is small enough")
        if solver.t == time:
            return np.array(solver.y, np.float64)
        if self._between is None:
            self._between = solver.dense_output()
        return np.asarray(self._between(time), np.float64)


def _is_timed(program: Program) -> bool:
    """Return whether the derivatives depend on the time itself."""
    ops: tuple[Op, ...] = (*program.minor, *program.derivatives)
    return any(slot.position == TIME.position for op in ops for slot in op.sources)


def _watched(program: Program) -> NDArray[np.intp]:
    """Return the slots that the derivatives read and that only a tick changes."""
    ops: tuple[Op, ...] = (*program.minor, *program.derivatives)
    moving = {
        position
        for op in program.minor
        for slot in op.targets
        for position in range(slot.position, slot.position + slot.size)
    }
    found: set[int] = set()
    for op in ops:
        for slot in op.sources:
            if slot.scalar != "frame":
                found.update(range(slot.position, slot.position + slot.size))
        block = program.blocks[op.block]
        found.update(range(block.position, block.position + block.record.kept))
    return np.array(sorted(found.difference(program.states, moving, (TIME.position,))), np.intp)
