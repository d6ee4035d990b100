"""Tests of the block signal.quantizer."""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.quantizer import Quantizer

U = [-1.25, -0.75, -0.5, -0.25, -0.2, 0, 0.2, 0.25, 0.74, 0.75, 1.25, 1.3]
RULES = {
    "nearest": [-1.5, -1.0, -0.5, -0.5, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.5, 1.5],
    "even": [-1.0, -1.0, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 1.0, 1.0, 1.5],
    "floor": [-1.5, -1.0, -0.5, -0.5, -0.5, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0],
    "ceil": [-1.0, -0.5, -0.5, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0, 1.5, 1.5],
    "fix": [-1.0, -0.5, -0.5, 0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.5, 1.0, 1.0],
}


@pytest.mark.parametrize("rule", RULES)
def test_halves_follow_the_rule_for_scalars_and_arrays_alike(rule: str) -> None:
    block = Quantizer(interval=0.5, rounding=rule)
    assert drive(block, u=U).y.tolist() == RULES[rule]
    assert drive(block, u=[U]).y[0].tolist() == RULES[rule]


def test_a_negative_input_gives_the_negative_output() -> None:
    u = np.random.default_rng(1).normal(size=200) * 10
    found = drive(Quantizer(interval=0.3), u=u).y
    assert np.array_equal(drive(Quantizer(interval=0.3), u=-u).y, -found)
    assert (np.abs(found - u) <= 0.15 + 1e-12).all()


def test_the_largest_number_below_a_half_is_rounded_down() -> None:
    assert drive(Quantizer(), u=[0.49999999999999994, 4503599627370497.0, 1e300]).y.tolist() == [
        0.0, 4503599627370497.0, 1e300,
    ]  # fmt: skip


def test_a_step_of_no_size_is_refused() -> None:
    with pytest.raises(ParameterError, match="interval must be above 0"):
        Quantizer(interval=0.0)
