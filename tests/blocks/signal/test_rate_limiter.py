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
    assert np.allclose(drive(RateLimiter(), u=[[9.0, -9.0, 0.5]]).y, [[1.0, -1.0, 0.5]])


def test_a_negative_limit_is_refused() -> None:
    with pytest.raises(ParameterError, match="falling must be at least 0"):
        RateLimiter(falling=-1.0)
