import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis_blocks.control.yaw import Yaw
from quadvis_blocks.control.yaw_rate import YawRate


def rate(block: YawRate, angle: float, reference: float = 0.0) -> float:
    return float(drive(block, steps=1, angle=angle, angle_reference=reference).rate[0])


@given(st.floats(-3, 3), st.floats(-3, 3), st.floats(0.3, 3.0))
def test_at_this_rate_the_law_of_yaw_asks_for_no_torque(
    angle: float, reference: float, bandwidth: float
) -> None:
    asked = rate(YawRate(bandwidth=bandwidth, limit=10.0), angle, reference)
    law = Yaw(bandwidth=bandwidth)
    found = drive(law, steps=1, angle=angle, angle_reference=reference, angular_rate=asked)
    assert found.torque[0] == pytest.approx(0.0, abs=1e-9)


def test_it_turns_the_short_way() -> None:
    across = rate(YawRate(bandwidth=2.0), math.radians(-175), math.radians(175))
    assert across == pytest.approx(-math.radians(10))


@pytest.mark.parametrize("angle", [-3.0, 3.0])
def test_the_rate_is_limited(angle: float) -> None:
    assert rate(YawRate(bandwidth=5.0, limit=0.8), angle) == math.copysign(0.8, -angle)
