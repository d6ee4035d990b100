import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.trusted_reference import TrustedReference

numbers = st.floats(-5, 5)
vectors = st.lists(numbers, min_size=3, max_size=3)
weights = st.floats(0, 1)


def trust(vectors: list[list[float]], headings: list[float], position: float, velocity: float) -> Driven:
    names = ("position_reference", "velocity_reference", "position", "velocity")
    inputs: dict[str, Any] = dict(zip(names, vectors, strict=True))
    reference, heading = headings
    return drive(
        TrustedReference(), **inputs, heading_reference=reference, heading=heading, position_weight=position,
        velocity_weight=velocity, steps=1,
    )  # fmt: skip


@given(st.lists(vectors, min_size=4, max_size=4), st.lists(numbers, min_size=2, max_size=2), weights, weights)
def test_every_error_counts_by_its_weight(
    vectors: list[list[float]], headings: list[float], position: float, velocity: float
) -> None:
    found = trust(vectors, headings, position, velocity)
    place, pace, craft, motion = (np.array(vector) for vector in vectors)
    assert craft[:2] - found.trusted_position[0, :2] == pytest.approx(
        position * (craft - place)[:2], abs=1e-12
    )
    assert motion[:2] - found.trusted_velocity[0, :2] == pytest.approx(
        velocity * (motion - pace)[:2], abs=1e-12
    )
    turn = math.remainder(headings[1] - headings[0], 2 * math.pi)
    left = math.remainder(headings[1] - found.trusted_heading[0], 2 * math.pi)
    assert abs(left) == pytest.approx(abs(position * turn), abs=1e-12)


@given(st.lists(vectors, min_size=4, max_size=4), weights, weights)
def test_height_and_climb_pass(vectors: list[list[float]], position: float, velocity: float) -> None:
    found = trust(vectors, [0.0, 0.0], position, velocity)
    assert found.trusted_position[0, 2] == vectors[0][2]
    assert found.trusted_velocity[0, 2] == vectors[1][2]


@given(st.lists(vectors, min_size=4, max_size=4), st.floats(-3.14, 3.14))
def test_full_weight_changes_nothing(vectors: list[list[float]], heading: float) -> None:
    found = trust(vectors, [heading, 1.0], 1.0, 1.0)
    assert (found.trusted_position[0] == vectors[0]).all() and (found.trusted_velocity[0] == vectors[1]).all()
    assert found.trusted_heading[0] == heading
