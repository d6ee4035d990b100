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


def test_what_was_cut_off_at_a_limit_does_not_come_back() -> None:
    u = np.array([10.0] * 1000 + [-10.0] * 12)
    y = drive(DiscreteIntegrator(lower=-1.0, upper=1.0), u=u, rate="100 Hz").y
    assert y[1000:] == pytest.approx(1.0 - 10.0 * np.arange(12) / 100)


@pytest.mark.parametrize(
    ("edge", "wanted"),
    [
        ("rising", [0, 1, 2, 7, 8, 9, 10, 7, 8]),
        ("falling", [0, 1, 7, 8, 9, 7, 8, 9, 10]),
        ("either", [0, 1, 7, 7, 8, 7, 8, 7, 8]),
        ("level", [7, 7, 8, 7, 7, 8, 9, 7, 7]),
    ],
)
def test_a_reset_gives_its_value_at_once_and_what_is_true_at_the_start_is_no_edge(
    edge: str, wanted: list[float]
) -> None:
    reset = [True, True, False, True, True, False, False, True, True]
    value = [7.0 if now else 100.0 for now in (1, 1, 1, 1, 1, 1, 0, 1, 1)]
    found = drive(DiscreteIntegrator(reset_on=edge), u=[1.0] * 9, reset=reset, value=value).y
    assert found.tolist() == wanted


def test_without_a_value_a_reset_gives_the_initial_one() -> None:
    found = drive(DiscreteIntegrator(initial=[1.0, 2.0]), u=[[1.0, 1.0]] * 3, reset=[False, True, False]).y
    assert np.array_equal(found, [[1, 2], [1, 2], [2, 3]])


def test_the_value_of_a_reset_is_cut_by_the_limits() -> None:
    block = DiscreteIntegrator(upper=2.0, reset_on="level")
    assert drive(block, u=[1.0] * 3, reset=[True, False, False], value=5.0).y.tolist() == [2.0, 2.0, 2.0]


def test_with_wrap_it_goes_on_from_the_other_limit() -> None:
    y = drive(DiscreteIntegrator(lower=-np.pi, upper=np.pi, wrap=True), u=[1.0] * 10, rate="1 Hz").y
    assert y == pytest.approx([0, 1, 2, 3, *(np.arange(4, 10) - 2 * np.pi)])
    assert (y < np.pi).all() and (y >= -np.pi).all()


def test_wrap_needs_limits() -> None:
    with pytest.raises(ParameterError, match="wrap must be false unless lower and upper are finite"):
        DiscreteIntegrator(wrap=True)
    with pytest.raises(ParameterError, match="lower must be below upper, 1, got 1"):
        DiscreteIntegrator(wrap=True, lower=1.0, upper=1.0, initial=1.0)
