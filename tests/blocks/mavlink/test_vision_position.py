"""Poses for an autopilot's estimator: signs and axes, each once, and none that is old or wrong."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.testing import drive
from quadvis.testing.alone import ALONE, alone
from quadvis.units import parse_period
from quadvis_blocks._angles import rotation
from quadvis_blocks.mavlink._attitude import ROS, ned_sigma, to_ned, to_ned_covariance
from quadvis_blocks.mavlink.vision_position import VisionPosition
from tests.blocks.mavlink.pymavlink_peer import received

ANGLE, PLACE = st.floats(-1.5, 1.5), st.floats(-100.0, 100.0)
HEADING = st.floats(-3.1, 3.1)


def device(**given: Any) -> VisionPosition:
    return VisionPosition(port="udp:127.0.0.1:14550", **given)


class Run:
    """The block, and the frames that it tells."""

    def __init__(self, **given: Any) -> None:
        self.block = device(**given)
        inputs = {
            "position": np.zeros(3), "roll": 0.0, "pitch": 0.0, "yaw": 0.0, "stamp": 0.0, "valid": True,
            "covariance": np.full((4, 4), np.nan),
        }  # fmt: skip
        self.engine = alone(self.block, inputs, {}, parse_period("10 Hz"))
        self.frames: list[bytes] = []
        self.numbers: list[int] = []
        self.engine.bound(ALONE).deliver = self.take

    def take(self, frame: bytes, number: int) -> None:
        self.frames.append(frame)
        self.numbers.append(number)

    def step(self, **inputs: Any) -> list[Any]:
        """Return what pymavlink reads of what is sent at this tick."""
        for name, value in inputs.items():
            self.engine.memory.write(self.engine.program[ALONE].inputs[name], value)
        before = len(self.frames)
        self.engine.run(1)
        assert bool(self.engine.read(ALONE, "sent")) == (len(self.frames) > before)
        return [received(self.block, frame) for frame in self.frames[before:]]


def test_a_pose_above_the_ceilings_origin_is_north_east_down() -> None:
    run = Run()
    with run.engine:
        run.step(valid=False)
        (found,) = run.step(
            position=np.array([1.0, 2.0, 3.0]), roll=0.1, pitch=0.2, yaw=0.3, stamp=0.05, valid=True
        )
    assert (found.get_type(), found.usec) == ("VISION_POSITION_ESTIMATE", 50_000)
    assert (found.x, found.y, found.z) == (1.0, 2.0, -3.0)
    assert [found.roll, found.pitch, found.yaw] == pytest.approx([0.1, 0.2, 0.3])
    assert math.isnan(found.covariance[0]) and found.covariance[1:] == [0.0] * 20


def test_each_pose_is_sent_once_and_none_that_is_wrong_or_old() -> None:
    run = Run()
    with run.engine:
        assert len(run.step(stamp=0.0)) == 1
        assert run.step() == []  # the same stamp
        assert run.step(stamp=0.2, valid=False) == []
        assert len(run.step(stamp=0.25, valid=True)) == 1
        assert run.step(stamp=0.1) == []
        assert run.step(stamp=9.0) == []  # ahead of the time
        assert run.step(stamp=0.55, position=np.array([np.nan, 0.0, 0.0])) == []
    assert run.numbers == [1, 2]


def body(roll: float, pitch: float, yaw: float, axes: int) -> Any:
    """Return the axes of a craft (columns: forward, right, down) in north, east, down, worked out by hand."""
    if axes != ROS:
        return rotation(roll, pitch, yaw)
    # forward, left, up in east, north, up: the plain rotation about z, y and x
    (cr, sr), (cp, sp), (cy, sy) = ((math.cos(a), math.sin(a)) for a in (roll, pitch, yaw))
    turn = (
        np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]])
        @ np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
        @ np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    )
    enu_to_ned = np.array([[0, 1, 0], [1, 0, 0], [0, 0, -1]])
    return enu_to_ned @ turn @ np.diag([1, -1, -1])


@pytest.mark.parametrize("axes", [0, ROS])
@given(angles=st.tuples(ANGLE, ANGLE, HEADING), place=st.tuples(PLACE, PLACE, PLACE))
def test_the_craft_points_where_it_pointed(
    axes: int, angles: tuple[float, float, float], place: tuple[float, float, float]
) -> None:
    moved, turned = to_ned(np.array(place), *angles, axes, 0.0)
    assert rotation(*turned) == pytest.approx(body(*angles, axes), abs=1e-12)
    x, y, z = place
    assert moved.tolist() == ([x, y, -z] if axes == 0 else [y, x, -z])


@given(place=st.tuples(PLACE, PLACE, PLACE), yaw=HEADING, north=HEADING)
def test_where_x_does_not_point_north_all_is_turned(
    place: tuple[float, float, float], yaw: float, north: float
) -> None:
    moved, turned = to_ned(np.array(place), 0.1, 0.2, yaw, 0, north)
    level = rotation(0.0, 0.0, north)
    assert moved == pytest.approx(level @ (np.array(place) * [1, 1, -1]), abs=1e-9)
    assert rotation(*turned) == pytest.approx(level @ rotation(0.1, 0.2, yaw), abs=1e-9)


@pytest.mark.parametrize("axes", [0, ROS])
def test_a_covariance_is_turned_as_its_pose(axes: int) -> None:
    random = np.random.default_rng(2)
    root = random.normal(size=(4, 4))
    covariance, north = root @ root.T, 0.7
    samples = random.multivariate_normal(np.zeros(4), covariance, 200_000)
    turned = [
        (*place, yaw[2])
        for place, yaw in (
            to_ned(each[:3], 0.0, 0.0, each[3] * 1e-3, axes, north) for each in samples[:20_000]
        )
    ]
    measured = np.cov(np.array(turned).T * np.array([[1], [1], [1], [1e3]]))
    worked_out = to_ned_covariance(covariance, axes, north)
    assert measured == pytest.approx(worked_out, abs=0.12 * np.abs(worked_out).max())
    assert ned_sigma(covariance, axes, north) == pytest.approx(np.sqrt(np.diag(worked_out)))


def test_a_covariance_arrives_as_the_upper_triangle_of_place_and_angles() -> None:
    run, covariance = Run(), np.diag([0.01, 0.02, 0.03, 0.04])
    covariance[0, 1] = covariance[1, 0] = 0.005
    covariance[2, 3] = covariance[3, 2] = 0.006
    with run.engine:
        (found,) = run.step(stamp=0.0, covariance=covariance)
    full = np.zeros((6, 6))
    full[np.triu_indices(6)] = found.covariance
    assert np.diag(full) == pytest.approx([0.01, 0.02, 0.03, 0.0, 0.0, 0.04])
    assert (full[0, 1], full[2, 5]) == pytest.approx((0.005, -0.006))


def test_the_twin_shows_what_would_be_sent() -> None:
    from quadvis_blocks.mavlink.null_vision import NullVision

    inputs = {
        "position": [[1.0, 2.0, 3.0]] * 3,
        "roll": [0.1] * 3,
        "pitch": [0.2] * 3,
        "yaw": [0.3] * 3,
        "stamp": [0.0, 0.0, 0.15],
    }
    found = [drive(block, rate="10 Hz", **inputs) for block in (NullVision(north=0.5), device(north=0.5))]
    for name in ("sent", "place", "angles", "sigma"):
        one, other = (np.asarray(getattr(each, name)) for each in found)
        assert np.array_equal(one, other, equal_nan=True)
    assert found[0].sent.tolist() == [True, False, True]
