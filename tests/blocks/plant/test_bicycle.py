"""The bicycle: arcs of circles by their formulas, its limits, and steering that swings against scipy."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.plant.bicycle import Bicycle


def test_constant_steering_gives_an_arc() -> None:
    car = Bicycle(wheelbase=2.5, initial_position=(1.0, 2.0), initial_heading=0.5)
    result = drive(car, speed=3.0, steering=0.4, rate="100 Hz", steps=501)
    rate = 3.0 / 2.5 * math.tan(0.4)
    heading = 0.5 + rate * result.time
    assert heading[-1] > 2.0  # it turns by more than a right angle
    assert result.heading == pytest.approx(heading, abs=1e-12)
    x = 1.0 + 3.0 / rate * (np.sin(heading) - math.sin(0.5))
    y = 2.0 - 3.0 / rate * (np.cos(heading) - math.cos(0.5))
    assert result.position == pytest.approx(np.column_stack((x, y)), abs=1e-9)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_speed_and_steering_stay_within_their_limits(side: float) -> None:
    beyond = drive(Bicycle(max_speed=2.0, max_steering=0.3), speed=5.0, steering=side, rate="10 Hz", steps=11)
    within = drive(Bicycle(), speed=2.0, steering=0.3 * side, rate="10 Hz", steps=11)
    assert beyond.position == pytest.approx(within.position, abs=1e-15)
    assert beyond.heading == pytest.approx(within.heading, abs=1e-15)


def test_it_goes_back() -> None:
    result = drive(Bicycle(max_speed=2.0), speed=-5.0, steering=0.0, rate="10 Hz", steps=11)
    assert result.position[-1] == pytest.approx([-2.0, 0.0])


def test_steering_that_swings_agrees_with_scipy() -> None:
    time = np.arange(301) / 100
    steps = 0.5 * np.sin(3.0 * time)
    result = drive(Bicycle(), speed=1.5, steering=steps, rate="100 Hz")

    def rates(t: float, state: np.ndarray) -> list[float]:
        turned = steps[min(int(t * 100 + 1e-9), 300)]
        return [1.5 * math.cos(state[2]), 1.5 * math.sin(state[2]), 1.5 * math.tan(turned)]

    wanted = [np.zeros(3)]
    for begin, end in itertools.pairwise(time):
        found = solve_ivp(lambda _, x, t=begin: rates(t, x), (begin, end), wanted[-1], rtol=1e-12, atol=1e-12)
        wanted.append(found.y[:, -1])
    assert np.column_stack((result.position, result.heading)) == pytest.approx(np.array(wanted), abs=1e-8)


def test_a_wheel_across_is_refused() -> None:
    with pytest.raises(ParameterError, match="max_steering must be below"):
        Bicycle(max_steering=math.pi / 2)
