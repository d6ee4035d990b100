import math
from itertools import pairwise

import numpy as np
import pytest

from quadvis.engine.solver import TABLEAUS, Solver
from quadvis.graph.graph import SOLVERS

ORDERS = {name: int(name[-1]) for name in SOLVERS}


def solve(name: str, rates, state: list[float], end: float, steps: int) -> np.ndarray:
    found, step = np.array(state), end / steps
    solver = Solver(name, step)
    for k in range(steps):
        found = solver.advance(rates, k * step, found, rates(k * step, found))
    return found


def pendulum(time: float, state: np.ndarray) -> np.ndarray:
    """Damped and driven: x'' = -x - 0.2 x' + cos 2t, with a closed form."""
    return np.array([state[1], math.cos(2 * time) - state[0] - 0.2 * state[1]])


def exact(time: float) -> float:
    """Return x(t) from x(0) = 1, x'(0) = 0."""
    a, b = np.linalg.solve([[-3.0, 0.4], [-0.4, -3.0]], [1.0, 0.0])
    w = math.sqrt(0.99)
    c = 1.0 - a
    d = (0.1 * c - 2 * b) / w
    decay = math.exp(-0.1 * time)
    return (
        a * math.cos(2 * time)
        + b * math.sin(2 * time)
        + decay * (c * math.cos(w * time) + d * math.sin(w * time))
    )


def test_the_closed_form_solves_the_equation() -> None:
    h = 1e-4
    for t in (0.0, 0.7, 3.0):
        first = (exact(t + h) - exact(t - h)) / (2 * h)
        second = (exact(t + h) - 2 * exact(t) + exact(t - h)) / h**2
        assert second == pytest.approx(math.cos(2 * t) - exact(t) - 0.2 * first, abs=1e-6)
    assert exact(0.0) == 1.0


@pytest.mark.parametrize("name", SOLVERS)
def test_the_error_falls_with_the_order_that_the_name_says(name: str) -> None:
    errors = [
        abs(solve(name, pendulum, [1.0, 0.0], 4.0, steps)[0] - exact(4.0)) for steps in (100, 200, 400, 800)
    ]
    orders = [math.log2(coarse / fine) for coarse, fine in pairwise(errors)]
    assert orders[-1] == pytest.approx(ORDERS[name], abs=0.1)


@pytest.mark.parametrize("name", SOLVERS)
def test_polynomials_in_time_of_the_order_are_integrated_exactly(name: str) -> None:
    power = ORDERS[name]
    found = solve(name, lambda time, _: np.array([power * time ** (power - 1)]), [0.0], 2.0, 5)
    assert found[0] == pytest.approx(2.0**power, rel=1e-14)


@pytest.mark.parametrize("name", SOLVERS)
def test_the_amplification_is_the_truncated_exponential(name: str) -> None:
    z = -0.7
    expected = sum(z**k / math.factorial(k) for k in range(ORDERS[name] + 1))
    assert solve(name, lambda _, x: z * x, [1.0], 1.0, 1)[0] == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize("name", SOLVERS)
def test_the_tableaus_are_consistent(name: str) -> None:
    tableau = TABLEAUS[name]
    assert sum(tableau.weights) == pytest.approx(1.0, abs=1e-15)
    assert [sum(stage) for stage in tableau.stages] == pytest.approx(list(tableau.nodes), abs=1e-15)
    assert [len(stage) for stage in tableau.stages] == list(range(len(tableau.weights)))


def test_every_solver_has_its_tableau() -> None:
    assert tuple(TABLEAUS) == SOLVERS
