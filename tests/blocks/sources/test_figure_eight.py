import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.sources.figure_eight import FigureEight


def test_it_waits_in_the_middle_until_it_sets_off() -> None:
    found = drive(FigureEight(begin=5.0, centre=[1.0, 2.0, 3.0]), rate="10 Hz", steps=51)
    assert (found.position == [1.0, 2.0, 3.0]).all() and (found.velocity == 0.0).all()


def test_the_velocity_is_the_derivative_of_the_position() -> None:
    found = drive(FigureEight(), rate="1 kHz", steps=30_000)
    middle = (found.position[2:] - found.position[:-2]) * 500.0
    assert found.velocity[1:-1] == pytest.approx(middle, abs=1e-6)
    assert np.abs(found.velocity[0]).max() == 0.0


def test_it_is_a_lemniscate_of_gerono_that_fills_its_box() -> None:
    found = drive(FigureEight(length=0.4, width=0.2), rate="100 Hz", steps=6000)
    x, y = found.position[:, 0] / 0.4, found.position[:, 1] / 0.2
    assert y**2 == pytest.approx(4 * x**2 * (1 - x**2), abs=1e-9)
    assert np.abs(x).max() == pytest.approx(1.0, abs=1e-4) and np.abs(y).max() == pytest.approx(1.0, abs=1e-4)
    assert (found.position[:, 2] == 1.5).all()


def test_it_comes_round_once_a_lap() -> None:
    found = drive(FigureEight(lap=10.0, start_time=0.5), rate="100 Hz", steps=3000)
    assert found.position[2000:] == pytest.approx(found.position[1000:2000], abs=1e-6)
