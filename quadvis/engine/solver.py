"""Fixed-step solvers of ordinary differential equations, named as in Simulink.

Each is its Butcher tableau: the nodes c, the rows of A (explicit, so one weight vector per stage), the
weights b. Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, table II.1; ode3 is the
third-order formula of Bogacki and Shampine, ode2 Heun's, ode4 the classical one of Runge and Kutta.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]
Rates = Callable[[float, Vector], Vector]  # the derivative of a state at a time; a fresh array each time


class Tableau(NamedTuple):
    """An explicit Runge-Kutta formula."""

    nodes: tuple[float, ...]
    stages: tuple[tuple[float, ...], ...]
    weights: tuple[float, ...]


TABLEAUS = {
    "ode1": Tableau((0.0,), ((),), (1.0,)),
    "ode2": Tableau((0.0, 1.0), ((), (1.0,)), (1 / 2, 1 / 2)),
    "ode3": Tableau((0.0, 1 / 2, 3 / 4), ((), (1 / 2,), (0.0, 3 / 4)), (2 / 9, 1 / 3, 4 / 9)),
    "ode4": Tableau(
        (0.0, 1 / 2, 1 / 2, 1.0), ((), (1 / 2,), (0.0, 1 / 2), (0.0, 0.0, 1.0)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)
    ),
}
ORDERS = {name: int(name[-1]) for name in TABLEAUS}  # of the error after a given time


class Solver:
    """Advances a state by one fixed step."""

    def __init__(self, name: str, step: float) -> None:
        tableau = TABLEAUS[name]
        self._stages = [
            (node * step, _scaled(weights, step))
            for node, weights in zip(tableau.nodes, tableau.stages, strict=True)
        ]
        self._weights = _scaled(tableau.weights, step)

    def advance(self, rates: Rates, time: float, state: Vector, slope: Vector) -> Vector:
        """Return the state one step later; ``slope`` is ``rates(time, state)``."""
        slopes = [slope]
        for node, weights in self._stages[1:]:
            slopes.append(rates(time + node, _moved(state, weights, slopes)))
        return _moved(state, self._weights, slopes)


def _scaled(weights: tuple[float, ...], step: float) -> list[tuple[int, float]]:
    return [(index, step * weight) for index, weight in enumerate(weights) if weight]


def _moved(state: Vector, weights: list[tuple[int, float]], slopes: list[Vector]) -> Vector:
    for index, weight in weights:
        state = state + weight * slopes[index]
    return state
