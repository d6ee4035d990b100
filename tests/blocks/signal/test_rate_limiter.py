import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.rate_limiter import RateLimiter


def test_a_step_becomes_ramps_with_the_slopes_of_the_limits() -> None:
    result = drive(RateLimiter(rising=20.0, falling=5.0), u=[0, 3, 3, 3, 0, 0], rate="10 Hz")
    assert result.y == pytest.approx([0.0, 2.0, 3.0, 3.0, 2.5, 2.0])


def test_a_slow_signal_passes_unchanged() -> None:
    u = [0.0, 0.05, 0.02, 0.1]
    assert drive(RateLimiter(), u=u, rate="10 Hz").y == pytest.approx(u)


def test_it_starts_from_its_initial_value() -> None:
    assert drive(RateLimiter(initial=4.0), u=[0.0, 0.0]).y == pytest.approx([3.0, 2.0])


def test_arrays_are_limited_element_by_element() -> None:
    assert np.allclose(drive(RateLimiter(initial=0.0), u=[[9.0, -9.0, 0.5]]).y, [[1.0, -1.0, 0.5]])


def test_a_negative_limit_is_refused() -> None:
    with pytest.raises(ParameterError, match="falling must be at least 0"):
        RateLimiter(falling=-1.0)


def test_without_an_initial_value_it_begins_with_the_first_input() -> None:
    assert drive(RateLimiter(), u=[7.0, 9.0]).y.tolist() == [7.0, 8.0]
    assert np.array_equal(drive(RateLimiter(), u=[[7.0, -2.0], [7.0, 2.0]]).y, [[7.0, -2.0], [7.0, -1.0]])


def test_a_step_at_the_start_is_limited_from_the_initial_value_on() -> None:
    block = RateLimiter(rising=2.0, falling=1.5, initial=0.0)
    y = drive(block, u=[1, 1, 1, 1, 1, 1, 0, 0, 0.85, 2], rate="10 Hz").y
    assert y == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0, 1.0, 0.85, 0.7, 0.85, 1.05], abs=1e-12)


def test_each_element_may_have_limits_and_an_initial_value_of_its_own() -> None:
    block = RateLimiter(rising=[1.0, 2.0], falling=0.5, initial=[np.inf, 0.0])
    found = drive(block, u=[[5.0, 5.0], [5.0, 5.0], [-5.0, -5.0]]).y
    assert np.array_equal(found, [[5.0, 2.0], [5.0, 4.0], [4.5, 3.5]])
