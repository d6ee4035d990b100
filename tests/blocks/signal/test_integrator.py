import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.integrator import Integrator


def test_a_constant_is_integrated_to_a_ramp() -> None:
    result = drive(Integrator(initial=1.0), u=2.0, rate="10 Hz", steps=11)
    assert result.y == pytest.approx(1.0 + 2.0 * result.time, abs=1e-12)


def test_it_stops_at_its_limits_and_does_not_wind_up() -> None:
    u = np.array([1.0] * 20 + [-1.0] * 5)
    result = drive(Integrator(lower=-0.5, upper=0.5), u=u, rate="10 Hz")
    assert result.y.max() == 0.5
    # 1.5 s at the limit are forgotten at once: it leaves with the input's sign.
    assert result.y[20:] == pytest.approx([0.5, 0.4, 0.3, 0.2, 0.1])


def test_arrays_are_integrated_and_limited_element_by_element() -> None:
    result = drive(Integrator(upper=0.35), u=np.tile([1.0, -1.0], (6, 1)), rate="10 Hz")
    assert result.y[5] == pytest.approx([0.35, -0.5])


def test_an_initial_value_beyond_a_limit_is_refused() -> None:
    with pytest.raises(ParameterError, match="initial must lie between -inf and 1, got 2"):
        Integrator(initial=2.0, upper=1.0)
