import math

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.low_pass import LowPass


@pytest.mark.parametrize("rate", ["5 Hz", "1 kHz"])
def test_a_step_is_answered_exactly_at_any_rate(rate: str) -> None:
    result = drive(LowPass(time_constant=0.5), u=1.0, rate=rate, steps=2000)
    assert result.y == pytest.approx(1.0 - np.exp(-result.time / 0.5), abs=1e-12)


def test_it_starts_from_its_initial_value_without_direct_feedthrough() -> None:
    result = drive(LowPass(time_constant=1.0, initial=2.0), u=[0.0, 100.0])
    assert result.y == pytest.approx([2.0, 2.0 * math.exp(-1.0)])


def test_arrays_are_smoothed_element_by_element() -> None:
    result = drive(LowPass(time_constant=1.0), u=[[1.0, -2.0], [0.0, 0.0]])
    assert result.y[1] == pytest.approx(np.array([1.0, -2.0]) * (1.0 - math.exp(-1.0)))


def test_a_time_constant_of_zero_is_refused() -> None:
    with pytest.raises(ParameterError, match="time_constant must be above 0 s, got 0 s"):
        LowPass(time_constant=0.0)
