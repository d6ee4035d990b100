"""Poses with the axes of Foxglove: which blocks have one, and that thrust points where the craft goes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from quadvis.api import load_text
from quadvis.bridge.poses import PoseColumns, pose_columns, pose_of, quaternion
from quadvis.output.recording import RecordedBlock, RecordedPort

POSITION = RecordedPort("position", "float64", (3,), "m")
ATTITUDE = RecordedPort("attitude", "float64", (3,), "rad")
angle = st.floats(-1.5, 1.5)


def port(name: str, unit: str = "rad") -> RecordedPort:
    return RecordedPort(name, unit=unit)


@pytest.mark.parametrize(
    ("ports", "columns"),
    [
        ((POSITION, ATTITUDE), PoseColumns((0, 1, 2), (3, 4, 5))),
        ((port("valid", "1"), POSITION, port("yaw")), PoseColumns((1, 2, 3), (None, None, 4))),
        ((POSITION, port("yaw"), port("roll"), port("pitch")), PoseColumns((0, 1, 2), (4, 5, 3))),
        ((POSITION,), None),
        ((POSITION, port("roll")), None),
        ((POSITION, port("yaw", "deg")), None),
        ((RecordedPort("position", "float64", (2,), "m"), ATTITUDE), None),
    ],
)
def test_a_pose_is_a_position_with_angles(
    ports: tuple[RecordedPort, ...], columns: PoseColumns | None
) -> None:
    assert pose_columns(RecordedBlock("/craft", ports)) == columns


@given(angle, angle, st.floats(-3.1, 3.1))
def test_the_quaternion_is_that_of_scipy(roll: float, pitch: float, yaw: float) -> None:
    found = Rotation.from_quat(quaternion((roll, pitch, yaw)))
    expected = Rotation.from_euler("ZYX", [yaw, pitch, roll])
    assert (found * expected.inv()).magnitude() == pytest.approx(0.0, abs=1e-7)


@pytest.mark.parametrize("attitude", [(0.3, 0.0, 0.0), (0.0, 0.3, 0.0), (0.2, -0.3, 1.0), (-0.4, 0.1, -2.5)])
def test_the_craft_goes_where_its_thrust_points(attitude: tuple[float, float, float]) -> None:
    text = f"""
quadvis: 1
name: falling
solver: {{method: ode4, step: 1 ms}}
stop_time: 1 ms
blocks:
  craft:
    block: plant.rotorcraft
    with:
      model: rigid_body
      drag: 0 N*s/m
      mass: 1 kg
      initial_attitude: {{value: {list(attitude)}, unit: rad}}
    in: {{thrust: hover.y}}
  hover:
    block: sources.constant
    rate: continuous
    with: {{value: {{value: [2.45, 2.45, 2.45, 2.45], unit: N}}}}
"""
    run = load_text(text).run()
    gained = run["craft.velocity"][-1] * 1000.0 + (0.0, 0.0, 9.81)  # m/s^2, by the thrust alone
    pose = pose_of(np.array([1.0, 2.0, 3.0, *attitude]), PoseColumns((0, 1, 2), (3, 4, 5)))
    assert pose is not None and pose.place == (1.0, -2.0, 3.0)
    up = Rotation.from_quat(pose.quaternion).apply([0.0, 0.0, 1.0])
    pushed = gained * (1.0, -1.0, 1.0)
    np.testing.assert_allclose(pushed / np.linalg.norm(pushed), up, atol=5e-3)


def test_a_pose_of_which_a_number_is_missing_is_none() -> None:
    columns = PoseColumns((0, 1, 2), (None, None, 3))
    assert pose_of(np.array([0.0, 0.0, np.nan, 0.0]), columns) is None
    assert pose_of(np.array([0.0, 0.0, 0.0, np.inf]), columns) is None
