import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

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
