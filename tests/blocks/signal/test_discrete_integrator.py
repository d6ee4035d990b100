import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.discrete_integrator import DiscreteIntegrator


def test_samples_are_summed_times_the_period() -> None:
    result = drive(DiscreteIntegrator(initial=1.0), u=[1.0, 2.0, -3.0, 0.0], rate="2 Hz")
    assert result.y.tolist() == [1.0, 1.5, 2.5, 1.0]


def test_it_stops_at_its_limits_and_leaves_them_at_once() -> None:
    result = drive(DiscreteIntegrator(lower=-1.0, upper=1.0), u=[1.0, 1.0, 1.0, -0.5, 0.0])
    assert result.y.tolist() == [0.0, 1.0, 1.0, 1.0, 0.5]


def test_it_stands_still_while_frozen() -> None:
    result = drive(DiscreteIntegrator(), u=[1.0, 1.0, 1.0, 1.0], freeze=[False, True, True, False])
    assert result.y.tolist() == [0.0, 1.0, 1.0, 1.0]


def test_arrays_are_summed_element_by_element() -> None:
    result = drive(DiscreteIntegrator(), u=np.tile([1.0, -2.0], (3, 1)))
    assert np.array_equal(result.y, [[0.0, 0.0], [1.0, -2.0], [2.0, -4.0]])


def test_an_initial_value_beyond_a_limit_is_refused() -> None:
    with pytest.raises(ParameterError, match="initial must lie between -inf and 1, got 2"):
        DiscreteIntegrator(initial=2.0, upper=1.0)
