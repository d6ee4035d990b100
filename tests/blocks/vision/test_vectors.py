"""Vectors and matrices of three against numpy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis_vision.camera.vectors import cross, determinant, dot, mixed, scaled, transposed, turned

numbers = st.floats(-10, 10)
vectors = st.tuples(numbers, numbers, numbers)
close = {"rel": 1e-12, "abs": 1e-10}


@given(vectors, vectors, vectors, numbers, numbers)
def test_they_are_those_of_numpy(a, b, c, p, q):
    matrix = (a, b, c)
    assert dot(a, b) == pytest.approx(np.dot(a, b), **close)
    assert cross(a, b) == pytest.approx(np.cross(a, b), **close)
    assert determinant(a, b, c) == pytest.approx(np.linalg.det(matrix), abs=1e-9)
    assert scaled(a, p) == pytest.approx(p * np.array(a), **close)
    assert mixed(a, p, b, q) == pytest.approx(p * np.array(a) + q * np.array(b), **close)
    assert turned(matrix, a) == pytest.approx(np.array(matrix) @ (a), **close)
    assert np.array_equal(transposed(matrix), np.array(matrix).T)
