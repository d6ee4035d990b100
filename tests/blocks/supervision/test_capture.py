import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import Driven, drive
from quadvis_blocks.supervision.capture import Capture

NOBODY = [False] * 4
PLACE = [0.4, -0.3, 1.8]


def hold(engaged: Any, block: Capture | None = None, **more: Any) -> Driven:
    """Hold 0, 0, 1.5 m at heading 0 with the craft at PLACE, turned by 0.2 rad; drive at 20 Hz."""
    inputs = {
        "position_reference": [0.0, 0.0, 1.5], "heading_reference": 0.0, "position": PLACE, "heading": 0.2,
        "engaged": engaged,
    }  # fmt: skip
    return drive(block or Capture(), rate="20 Hz", **{**inputs, **more})


def test_the_law_takes_over_at_the_place_where_the_craft_is() -> None:
    found = hold([NOBODY, [True] * 4, NOBODY])
    assert found.shifted_position == pytest.approx(np.array([[0.0, 0.0, 1.5], PLACE, PLACE]))
    assert found.shifted_heading == pytest.approx([0.0, 0.2, 0.2])
    assert found.captured.tolist() == [False, True, False]
    assert (found.shifted_velocity == 0.0).all()


@pytest.mark.parametrize(
    ("channel", "position", "heading"),
    [
        (0, [0.0, 0.0, 1.8], 0.0),
        (1, [0.4, -0.3, 1.5], 0.0),
        (2, [0.4, -0.3, 1.5], 0.0),
        (3, [0, 0, 1.5], 0.2),
    ],
)
def test_each_channel_captures_what_it_controls(channel: int, position: list[float], heading: float) -> None:
    found = hold([NOBODY, [place == channel for place in range(4)]])
    assert found.shifted_position[1] == pytest.approx(position)
    assert found.shifted_heading[1] == pytest.approx(heading)


@pytest.mark.parametrize(("away", "taken"), [(0.49, False), (0.51, True)])
def test_vision_that_comes_back_captures_only_a_craft_that_has_moved(away: float, taken: bool) -> None:
    found = hold([NOBODY] * 2, position=[away, 0.0, 1.0], rearmed=[True, False])
    assert found.captured.tolist() == [taken, False]
    assert found.shifted_position == pytest.approx(np.array([[away if taken else 0.0, 0.0, 1.5]] * 2))


def test_a_moving_reference_moves_on_from_there() -> None:
    reference = np.linspace([0.0, 0.0, 1.5], [1.0, 0.0, 1.5], 21)
    found = hold(
        [[True] * 4] + [NOBODY] * 20, position_reference=reference, velocity_reference=[1.0, 0.0, 0.0]
    )
    assert found.shifted_position == pytest.approx(reference + np.array([0.4, -0.3, 0.3]))
    assert (found.shifted_velocity == [1.0, 0.0, 0.0]).all()


def test_with_a_return_speed_the_craft_goes_back_in_a_straight_line() -> None:
    found = hold([[True] * 4] + [NOBODY] * 40, Capture(return_speed=0.5))
    away = np.linalg.norm(found.shifted_position - [0.0, 0.0, 1.5], axis=1)
    length = math.sqrt(0.4**2 + 0.3**2 + 0.3**2)
    assert away == pytest.approx(np.maximum(length - 0.5 * found.time, 0.0), abs=1e-12)
    speed = np.linalg.norm(found.shifted_velocity, axis=1)
    assert speed[:20] == pytest.approx(0.5) and (speed[25:] == 0.0).all()
    assert np.diff(found.shifted_position, axis=0) == pytest.approx(found.shifted_velocity[:-1] * 0.05)


@given(st.floats(-3, 3), st.floats(-3, 3))
def test_a_captured_heading_is_that_of_the_craft_whatever_the_turn(heading: float, reference: float) -> None:
    found = hold([[True] * 4], heading=[heading], heading_reference=[reference])
    assert math.remainder(found.shifted_heading[0] - heading, 2 * math.pi) == pytest.approx(0.0, abs=1e-12)
