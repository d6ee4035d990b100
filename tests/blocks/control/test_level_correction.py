import math

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.control.level_correction import LevelCorrection


def test_an_angle_that_is_taken_passes_unchanged() -> None:
    wanted = np.linspace(-0.2, 0.2, 20)
    assert drive(LevelCorrection(), wanted=wanted, measured=wanted, rate="20 Hz").asked == pytest.approx(
        wanted
    )


def test_a_level_that_is_off_is_found_within_some_time_constants() -> None:
    """A flight controller whose level is 0.03 rad off, and which takes what it is asked at once."""
    asked = measured = 0.0
    wanted, off, readings = 0.05, 0.03, []
    for _ in range(50):  # the block starts anew each time, so it is given the whole past
        readings.append(measured)
        asked = drive(
            LevelCorrection(time_constant=0.2), wanted=wanted, measured=readings, rate="20 Hz"
        ).asked[-1]
        measured = asked - off
    assert measured == pytest.approx(wanted, abs=1e-4)
    assert asked == pytest.approx(wanted + off, abs=1e-4)


def test_it_grows_with_its_time_constant_up_to_its_limit_and_back_at_once() -> None:
    block = LevelCorrection(time_constant=2.0, limit=0.1)
    measured = [-0.2] * 40 + [0.2] * 20
    asked = drive(block, wanted=0.0, measured=measured, rate="10 Hz").asked
    assert asked[:12] == pytest.approx(np.minimum(0.1, 0.01 * np.arange(12)))
    assert asked[11:41] == pytest.approx(np.full(30, 0.1))
    assert asked[41] == pytest.approx(0.09)
    assert asked.min() >= -0.1


def test_on_the_ground_and_without_a_measurement_it_stands_still() -> None:
    frozen = drive(
        LevelCorrection(), wanted=0.1, measured=[0.0] * 10, freeze=[False] * 5 + [True] * 5, rate="10 Hz"
    )
    assert frozen.asked == pytest.approx(0.1 + 0.01 * np.minimum(np.arange(10), 5))
    blind = drive(LevelCorrection(), wanted=0.1, measured=[0.0] * 3 + [math.nan] * 5, rate="10 Hz")
    assert blind.asked == pytest.approx(0.1 + 0.01 * np.minimum(np.arange(8), 3))
