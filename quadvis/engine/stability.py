"""Whether the solver's step is small enough for the poles of the continuous states.

The states are linearised as the solver sees them: between two ticks, with all sampled signals held. A formula
of Runge and Kutta with as many stages as its order multiplies the part of a pole p in each step h by the
truncated exponential of h p, and is stable while that is at most 1. Source: Hairer and Wanner, Solving
Ordinary Differential Equations II, section IV.2.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from fractions import Fraction
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.interpreter import Interpreter, MinorError
from quadvis.engine.layout import TIME
from quadvis.engine.program import Program
from quadvis.engine.solver import ORDERS
from quadvis.units import Unit, format_quantity

SECOND = Unit.parse("s")
DELTA = 1e-5  # of a central difference, relative to values above 1
RESTING = 1e-9  # of a pole's size: poles with less damping are those of oscillations that may go on
REACH = 3.0  # of h p: beyond, no formula is stable to the left of the origin
SCANNED = 300
NEAR_LIMIT = 20.0  # so many times a step is its limit where it may be bounded by it
NOISE = 1e-7  # of the fastest pole: slower ones may come from rounding
APART = 1000.0  # how much faster than the slowest the fastest pole of stiff states is
REMEDY = "make the step smaller, or use 'method: Radau'"

Matrix = NDArray[np.float64]


class StatePole(NamedTuple):
    """A pole (1/s) of the continuous states, and the block whose states have the largest share in it."""

    value: complex
    block: str

    @property
    def shown(self) -> str:
        """It, as text."""
        real, imaginary = self.value.real, abs(self.value.imag)
        whole = f"{real:.4g}" if imaginary < 1e-6 * abs(self.value) else f"{real:.3g} +- {imaginary:.3g}j"
        return f"{whole} 1/s"


class TooLargeStep(NamedTuple):
    """A solver's step (s) beyond that up to which it is stable for a pole."""

    solver: str
    step: float
    pole: StatePole
    limit: float

    @property
    def problem(self) -> str:
        """What is wrong, in words."""
        whose = f"for '{self.pole.block}', whose fastest pole is at {self.pole.shown}"
        stable = f"{self.solver} is stable up to {format_quantity(self.limit, SECOND, 3)}"
        return f"the solver's step of {format_quantity(self.step, SECOND, 3)} is too large {whose} ({stable})"

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        pole = self.pole.value
        return {"block": self.pole.block, "pole": [pole.real, pole.imag], "stable_to_s": self.limit}


@lru_cache(maxsize=1024)
def stable_to(solver: str, pole: complex) -> float:
    """Return the largest step (s) with which a solver lets the part of a pole (1/s) decay; inf without limit.

    A pole that grows, or hardly decays, asks for no step.
    """
    if solver not in ORDERS or pole.real >= -RESTING * abs(pole):
        return math.inf
    direction, order = pole / abs(pole), ORDERS[solver]

    def grows(size: float) -> bool:
        z = size * direction
        return abs(sum(z**power / math.factorial(power) for power in range(order + 1))) > 1.0

    least, most = 0.0, REACH
    for number in range(1, SCANNED + 1):
        most = REACH * number / SCANNED
        if grows(most):
            break
        least = most
    for _ in range(60):
        middle = (least + most) / 2
        least, most = (least, middle) if grows(middle) else (middle, most)
    return least / abs(pole)


def poles(interpreter: Interpreter) -> list[StatePole]:
    """Return the poles of the continuous states as they are now, the fastest first; [] without states.

    They are those of the time of the next tick, before its outputs: sampled signals have the values of the
    last one. [] if a block fails there, or a slope is not finite. The memory stays as it is.
    """
    places = np.array(interpreter.program.states, np.intp)
    raw, floats = interpreter.memory.raw, interpreter.memory.floats
    if not places.size or not np.isfinite(floats[places]).all():
        return []
    before = bytes(raw)
    try:
        matrix = _derivative(interpreter, floats[places], float(floats[TIME.position]))
    except MinorError:
        return []
    finally:
        raw[:] = before
    return _named(matrix, interpreter.program) if np.isfinite(matrix).all() else []


def _derivative(interpreter: Interpreter, state: Matrix, time: float) -> Matrix:
    found = np.empty((state.size, state.size))
    for column, value in enumerate(state):
        step = DELTA * max(1.0, abs(value))
        sides = []
        for sign in (1.0, -1.0):
            moved = state.copy()
            moved[column] += sign * step
            sides.append(interpreter.rates(time, moved))
        with np.errstate(invalid="ignore", over="ignore"):
            found[:, column] = (sides[0] - sides[1]) / (2 * step)
    return found


def _named(matrix: Matrix, program: Program) -> list[StatePole]:
    """Return the eigenvalues with their blocks, by the shares of the states: left times right eigenvector."""
    values, vectors = np.linalg.eig(matrix)
    owners = list(_owners(program))
    try:
        shares = np.abs(np.linalg.inv(vectors).T * vectors)
    except np.linalg.LinAlgError:  # several poles are one, such as those of two integrators in a row
        shares = np.abs(vectors)
    found = []
    for number, value in enumerate(values.tolist()):
        sums: dict[str, float] = {}
        for owner, share in zip(owners, shares[:, number], strict=True):
            sums[owner] = sums.get(owner, 0.0) + float(share)
        found.append(StatePole(complex(value), max(sums, key=lambda owner: sums[owner])))
    return sorted(found, key=lambda pole: -abs(pole.value))


def _owners(program: Program) -> Iterator[str]:
    """Yield the block of each element of the continuous states, in the order of the program."""
    for block in program.blocks:
        for name in block.slopes:
            yield from [block.path] * block.field(name).size


def stiffness(solver: str, step: Fraction, found: list[StatePole]) -> str:
    """Return a sentence if a stable step is bounded by what has decayed long before the rest; else ""."""
    slow = [pole for pole in found if abs(pole.value) > NOISE * abs(found[0].value)]
    if not slow or stable_to(solver, found[0].value) > NEAR_LIMIT * float(step):
        return ""
    ratio = abs(found[0].value) / abs(slow[-1].value)
    if ratio < APART:
        return ""
    fast = f"the pole of '{found[0].block}' at {found[0].shown}"
    bounded = f"is {ratio:.2g} times as fast as the slowest, and bounds the step of {solver}"
    return f"stiff: {fast} {bounded}; 'method: Radau' has no such bound"


def too_large(solver: str, step: Fraction, found: list[StatePole]) -> TooLargeStep | None:
    """Return the pole for which a step (s) is too large, the one that asks for the smallest; None if none."""
    limits = [(stable_to(solver, pole.value), number) for number, pole in enumerate(found)]
    least, number = min(limits, default=(math.inf, 0))
    if float(step) <= least * (1 + 1e-9):
        return None
    return TooLargeStep(solver, float(step), found[number], least)


class Marks:
    """The memory at some ticks of a run, so that what went wrong later can be linearised where it began.

    The newest few are kept, and of those before ever fewer.
    """

    KEPT = 32

    def __init__(self, interpreter: Interpreter) -> None:
        self._interpreter = interpreter
        self._found: list[bytes] = []

    def note(self) -> None:
        """Keep the present memory."""
        self._found.append(bytes(self._interpreter.memory.raw))
        if len(self._found) > self.KEPT:
            half = self.KEPT // 2
            self._found = [*self._found[:half:2], *self._found[half:]]

    def cause(self) -> TooLargeStep | None:
        """Return the pole for which the step was too large at the first of these ticks at which one was."""
        program, raw = self._interpreter.program, self._interpreter.memory.raw
        now = bytes(raw)
        try:
            for mark in self._found:
                raw[:] = mark
                found = too_large(program.solver, program.period, poles(self._interpreter))
                if found is not None:
                    return found
            return None
        finally:
            raw[:] = now
