"""The twin of the poses that go to an autopilot; tests of the device compare the two."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.mavlink.null_vision import NullVision


def test_place_and_angles_are_those_of_the_message() -> None:
    found = drive(
        NullVision(),
        rate="10 Hz",
        position=[1.0, 2.0, 3.0],
        roll=0.1,
        pitch=0.2,
        yaw=0.3,
        stamp=[0.0],
        covariance=np.diag([0.04, 0.09, 0.01, 0.0004]),
    )
    assert found.sent[-1] and found.place[-1].tolist() == [1.0, 2.0, -3.0]
    assert found.angles[-1].tolist() == [0.1, 0.2, 0.3]
    assert found.sigma[-1] == pytest.approx([0.2, 0.3, 0.1, 0.02])


def test_what_is_not_sent_is_missing() -> None:
    given = {"position": [1.0, 2.0, 3.0], "roll": 0.1, "pitch": 0.2, "yaw": 0.3}
    found = drive(NullVision(), rate="10 Hz", valid=[False], **given)
    assert not found.sent[-1] and np.isnan(found.place[-1]).all() and np.isnan(found.sigma[-1]).all()
