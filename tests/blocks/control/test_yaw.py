import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.yaw import Yaw


def torque(block: Yaw, **inputs: float) -> float:
    return float(drive(block, steps=1, **({"angle": 0.0, "angular_rate": 0.0} | inputs)).torque[0])


def test_the_gains_follow_from_the_bandwidth() -> None:
    # lambda 1.5: a1 = 3, a2 = 2.25
    assert torque(Yaw(bandwidth=1.5), angle=0.2, angular_rate=0.1) == pytest.approx(-0.45 - 0.3)


def test_raw_gains_override_the_bandwidth() -> None:
    assert torque(Yaw(gains=(0.5, 4.0)), angle=0.2, angular_rate=0.1) == pytest.approx(-0.8 - 0.05)


@given(st.floats(-3, 3), st.floats(-3, 3), st.integers(-2, 2))
def test_it_turns_the_short_way_whatever_the_turns(angle: float, reference: float, turns: int) -> None:
    full = 2 * math.pi * turns
    assert (
        torque(Yaw(), angle=angle + full, angle_reference=reference)
        == pytest.approx(torque(Yaw(), angle=angle, angle_reference=reference), abs=1e-9)
        or abs(abs(angle - reference) - math.pi) < 1e-9
    )


def test_across_the_seam_the_error_is_small() -> None:
    assert torque(Yaw(), angle=math.radians(-175), angle_reference=math.radians(175)) == pytest.approx(
        -math.radians(10)
    )


def test_the_torque_is_limited() -> None:
    assert torque(Yaw(torque_limit=2.0), angular_rate=50.0) == -2.0


def test_reference_rate_and_feedforward_shift_the_balance() -> None:
    assert torque(Yaw(), angular_rate=0.4, angular_rate_reference=0.4) == 0.0
    assert torque(Yaw(), feedforward=0.3) == pytest.approx(0.3)


def test_one_gain_without_the_other_is_refused() -> None:
    with pytest.raises(ParameterError, match="gains must both be above 0, or both 0"):
        Yaw(gains=(0.0, 1.0))


LOOP = """
quadvis: 1
name: loop
rates: {control: 20 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 40 s
blocks:
  craft: {block: plant.lateral, in: {torque: {from: sum.y, across: hold}}}
  law:
    block: control.yaw
    rate: control
    with: {integral: INTEGRAL 1/s}
    in:
      angle: {from: craft.angle, across: sample}
      angular_rate: {from: craft.angular_rate, across: sample}
  sum: {block: signal.sum, rate: control, in: {u: [law.torque, {value: 0.025, unit: rad/s^2}]}}
"""


@pytest.mark.parametrize(("integral", "left"), [(0.0, 0.025), (0.2, 0.0)])  # d / a2, and nothing
def test_with_an_integral_a_torque_that_lasts_leaves_no_error(integral: float, left: float) -> None:
    flown = load_text(LOOP.replace("INTEGRAL", f"{integral}")).run()
    assert flown["craft.angle"][-1] == pytest.approx(left, abs=1e-4)


def test_the_integral_goes_the_short_way_and_stands_still_at_the_limit() -> None:
    block = Yaw(integral=0.5, torque_limit=1.0)
    result = drive(block, angle=[3.0] * 100 + [-0.1], angular_rate=0.0, rate="10 Hz")
    assert result.torque[:100] == pytest.approx(np.full(100, -1.0))
    assert result.torque[100] == pytest.approx(0.1)


def test_an_integral_faster_than_the_damping_is_refused() -> None:
    with pytest.raises(ParameterError, match="integral must be below 2 1/s, the damping, got 3 1/s"):
        Yaw(integral=3.0)
