"""Normal equations, Cholesky's factor, solution and inverse against numpy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_vision.pose.least_squares import factored, inverted, solved, squares, undetermined
from tests.blocks.vision.plain import full

problems = st.tuples(st.integers(1, 7), st.integers(0, 2**32 - 1))


def draw(count, seed, rows=0):
    """Random equations (more than unknowns), with columns of different sizes, and their normal matrix."""
    rng = np.random.default_rng(seed)
    made = rng.normal(size=(rows or count + 3, count)) * 10.0 ** rng.uniform(-2, 2, count)
    return made, squares([tuple(row) for row in made.tolist()], count)


def scaled(matrix, like):
    size = np.sqrt(np.diag(like))
    return matrix / np.outer(size, size)


@given(problems)
def test_the_squares_are_the_normal_matrix(problem):
    made, triangle = draw(*problem)
    normal = made.T @ made
    assert scaled(full(triangle, problem[0]), normal) == pytest.approx(scaled(normal, normal), abs=1e-13)


@given(problems)
def test_the_factor_is_the_one_of_cholesky(problem):
    made, triangle = draw(*problem)
    lower = np.tril(full(factored(triangle, problem[0]), problem[0]))
    assert np.allclose(lower, np.linalg.cholesky(made.T @ made), rtol=1e-9)


@given(problems)
def test_the_solution_is_that_of_least_squares(problem):
    count, seed = problem
    made, triangle = draw(count, seed)
    measured = np.random.default_rng(seed + 1).normal(size=len(made))
    expected, *_ = np.linalg.lstsq(made, measured)
    found = solved(factored(triangle, count), (made.T @ measured).tolist(), count)
    assert np.allclose(found, expected, rtol=1e-6, atol=1e-9 * np.abs(expected).max())


@given(problems)
def test_the_inverse_is_that_of_numpy(problem):
    made, triangle = draw(*problem)
    expected = np.linalg.inv(made.T @ made)
    found = full(inverted(factored(triangle, problem[0]), problem[0]), problem[0])
    assert scaled(found, expected) == pytest.approx(scaled(expected, expected), abs=1e-6)


def test_the_first_unknowns_of_a_triangle_are_those_of_the_matrix():
    made, triangle = draw(6, 3)
    assert triangle[:10] == squares([tuple(row[:4]) for row in made.tolist()], 4)
    assert factored(triangle, 4) == factored(triangle, 6)[:10]


@pytest.mark.parametrize(
    "matrix",
    [[0.0], [-1.0], [np.nan], [1.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, np.nan, 1.0], [1.0, 0.0, np.nan]],
)
def test_what_is_not_positive_definite_has_no_factor(matrix):
    assert factored(matrix, len(matrix) // 2 + 1) == undetermined() == []


def test_the_matrix_stays_as_it_is():
    _, triangle = draw(5, 4)
    before = list(triangle)
    inverted(factored(triangle, 5), 5)
    assert triangle == before
