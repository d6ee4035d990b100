from typing import Any

import numpy as np
import pytest

from quadvis.testing import Driven, drive
from quadvis_blocks.estimation.reckoned_height import ReckonedHeight

MASS, DRAG, WEIGHT = 0.5, 0.1, 0.5 * 9.81


def fly(height: Any, collective: Any, blind: Any, seconds: float, **more: Any) -> Driven:
    """Drive at 20 Hz with frames at 10 Hz that arrive 0.1 s after they were taken; ``height`` of time."""
    time = np.arange(round(20 * seconds)) / 20
    stamp = np.floor(time * 10 + 1e-9) / 10 - 0.1
    measured = np.zeros((len(time), 3))
    measured[:, 2] = height(stamp)
    blind = np.array([blind(t) for t in time])
    stamp[blind] = stamp[~blind][-1] if not blind.all() else np.nan
    block = ReckonedHeight(trim_bandwidth=more.pop("trim_bandwidth", 0.1))
    return drive(
        block, position=measured, velocity=[0.1, 0.2, 0.3], stamp=stamp, blind=blind,
        collective=[collective(t) for t in time], rate="20 Hz", **{"roll": 0.0, "pitch": 0.0, **more},
    )  # fmt: skip


def test_while_vision_counts_it_passes_what_is_measured() -> None:
    found = fly(np.sin, lambda t: WEIGHT, lambda t: False, 3.0)
    stamp = np.floor(found.time * 10 + 1e-9) / 10 - 0.1
    assert (found.known_position[:, 2] == np.sin(stamp)).all()
    assert (found.known_velocity == [0.1, 0.2, 0.3]).all()


def test_blind_it_falls_as_a_body_with_that_thrust_and_drag_does() -> None:
    # A hover until 10 s, then 0.3 N less: h' = -(0.3 / drag) (1 - exp(-drag t / m)), after the motors' lag.
    found = fly(lambda s: 1.5 + 0.0 * s, lambda t: WEIGHT - 0.3 * (t >= 10), lambda t: t >= 10, 13.0)
    elapsed = found.time[found.time >= 11] - 10 - 0.08 - 0.05
    climb = -3.0 * (1.0 - np.exp(-elapsed * DRAG / MASS))
    assert found.known_velocity[found.time >= 11, 2] == pytest.approx(climb, abs=0.03)
    fallen = -3.0 * (elapsed + (np.exp(-elapsed * DRAG / MASS) - 1.0) * MASS / DRAG)
    assert found.known_position[found.time >= 11, 2] == pytest.approx(1.5 + fallen, abs=0.05)


def test_a_climb_goes_on_blind_and_dies_away_in_the_air() -> None:
    # 0.2 m/s held up against the drag, then the weight alone.
    def height(t: Any) -> Any:
        return 1.0 + 0.2 * t

    found = fly(
        height, lambda t: WEIGHT + (0.02 if t < 8 else 0.0), lambda t: t >= 8, 12.0, trim_bandwidth=0.0
    )
    late = found.time >= 8
    climb = 0.2 * np.exp(-(found.time[late] - 8) * DRAG / MASS)
    assert found.known_velocity[late, 2] == pytest.approx(climb, abs=0.02)
    assert found.known_position[late, 2][0] == pytest.approx(height(8.0), abs=0.02)


def test_a_thrust_that_is_not_what_it_should_be_is_taken_in_as_trim() -> None:
    # The rotors are told 3 % more than the weight and yet the craft hovers.
    found = fly(lambda s: 1.5 + 0.0 * s, lambda t: 1.03 * WEIGHT, lambda t: t >= 60, 65.0)
    assert found.trim[-1] == pytest.approx(-0.03 * 9.81, rel=0.02)
    assert found.known_position[-1, 2] == pytest.approx(1.5, abs=0.1)


def test_horizontally_it_passes_what_comes_even_blind() -> None:
    found = fly(lambda s: 1.5 + 0.0 * s, lambda t: WEIGHT, lambda t: t >= 1, 2.0, roll=0.3)
    assert (found.known_position[:, :2] == 0.0).all()
    assert (found.known_velocity[:, :2] == [0.1, 0.2]).all()


def test_a_model_whose_rotors_idle_does_not_sink_for_ever() -> None:
    found = fly(lambda s: 0.5 + 0.0 * s, lambda t: 0.0 if t >= 5 else WEIGHT, lambda t: t >= 5, 10.0)
    assert found.known_position[:, 2].min() == -10.0
    assert found.known_position[-1, 2] == -10.0 and found.known_velocity[-1, 2] == 0.0
