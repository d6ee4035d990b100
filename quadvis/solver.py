"""Fixed-step solvers of ordinary differential equations, named as in Simulink.

Each is its Butcher tableau: the nodes c, the rows of A (explicit, so one weight vector per stage) and the weights b.
Source: Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, table II.1; ode3 is Bogacki-Shampine's
third-order formula, ode2 Heun's, ode4 the classical Runge-Kutta formula.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Vector = NDArray[np.float64]


@dataclass(frozen=True)
class Tableau:
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


def integrate(
    name: str, rates: Callable[[float, Vector], Vector], time: float, state: Vector, step: float
) -> Vector:
    """Return the state one step later; ``rates(time, state)`` gives its derivative, at major and minor steps."""
    tableau = TABLEAUS[name]
    slopes: list[Vector] = []
    for node, weights in zip(tableau.nodes, tableau.stages, strict=True):
        guess = state
        for weight, slope in zip(weights, slopes, strict=True):
            if weight:
                guess = guess + (step * weight) * slope
        slopes.append(rates(time + node * step, guess))
    result = state
    for weight, slope in zip(tableau.weights, slopes, strict=True):
        result = result + (step * weight) * slope
    return result
