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


def test_limits_and_resets_as_in_closed_form() -> None:
    step = 0.05
    t = np.arange(201) * step
    u = np.where(t < 4 - 1e-9, 1.0, np.where(t < 7 - 1e-9, -1.0, 3.0))
    reset = ((t >= 5 - 1e-9) & (t < 5.5 - 1e-9)) | (t >= 7.5 - 1e-9)
    block = Integrator(lower=0.0, upper=2.0, initial=0.5)
    y = drive(block, u=u, reset=reset, value=0.25, rate="20 Hz").y
    wanted = {
        1: 1.5, 1.5: 2, 3: 2, 4: 2, 4.5: 1.5, 5: 0.25, 5.1: 0.15, 5.25: 0, 6.5: 0, 7: 0, 7.25: 0.75,
        7.5: 0.25, 8: 1.75, 8.25: 2, 10: 2,
    }  # fmt: skip
    found = [y[round(time / step)] for time in wanted]
    assert found == pytest.approx(list(wanted.values()), abs=1e-9)


def test_while_its_level_holds_a_reset_keeps_it_at_the_value() -> None:
    block = Integrator(reset_on="level")
    y = drive(block, u=[1.0] * 6, reset=[0, 0, 1, 1, 0, 0], value=5.0, rate="1 Hz").y
    assert y == pytest.approx([0, 1, 5, 5, 5, 6])


def test_with_wrap_an_angle_stays_between_its_limits() -> None:
    y = drive(Integrator(upper=2 * np.pi, lower=0.0, wrap=True), u=2.0, rate="10 Hz", steps=100)
    assert y.y == pytest.approx(np.mod(2.0 * y.time, 2 * np.pi), abs=1e-9)


def test_each_element_may_have_limits_of_its_own() -> None:
    block = Integrator(upper=[0.25, 1.0], initial=[0.0, 0.5])
    y = drive(block, u=np.ones((11, 2)), rate="10 Hz").y
    assert y[-1] == pytest.approx([0.25, 1.0]) and y[1] == pytest.approx([0.1, 0.6])
    with pytest.raises(ParameterError, match=r"initial must lie between -inf and 0\.25, got 0\.5"):
        Integrator(upper=[1.0, 0.25], initial=[0.0, 0.5])
