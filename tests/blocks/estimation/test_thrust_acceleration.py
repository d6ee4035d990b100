import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis.testing import drive
from quadvis_blocks.estimation.thrust_acceleration import ThrustAcceleration

angle = st.floats(-1.2, 1.2)


@given(st.floats(0.0, 8.0), angle, angle, st.floats(-3.1, 3.1))
def test_the_thrust_points_up_the_body_whatever_its_attitude(
    collective: float, roll: float, pitch: float, yaw: float
) -> None:
    found = drive(
        ThrustAcceleration(), collective=collective, roll=roll, pitch=pitch, yaw=yaw, steps=1
    ).acceleration[0]
    down = Rotation.from_euler("ZYX", [yaw, pitch, roll]).apply([0.0, 0.0, -collective / 0.5])
    assert found == pytest.approx([down[0], down[1], -down[2] - 9.81], abs=1e-12)


def test_a_hover_has_no_acceleration() -> None:
    assert (
        np.abs(drive(ThrustAcceleration(), collective=4.905, roll=0.0, pitch=0.0, steps=1).acceleration).max()
        < 1e-12
    )
