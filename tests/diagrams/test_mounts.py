"""Flights with a camera that sits askew on the craft, and estimates that know this or do not."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import quadvis
from tests.mounted import mounted
from tests.stages import mostly_slow

OFFSET, ANGLES = (0.12, -0.08, 0.06), (0.04, -0.05, 0.3)
KNOWN = {
    "estimate.mount_offset": f"{{value: {list(OFFSET)}, unit: m}}",
    "estimate.mount_angles": f"{{value: {list(ANGLES)}, unit: rad}}",
}


def flight(folder: Path, variant: str, known: bool) -> Any:
    path = mounted(folder, variant, OFFSET, ANGLES)
    return quadvis.load(path, settings=KNOWN if known else {}, stop_time=10, seed=1).run()


def errors(result: Any) -> Any:
    """Mean errors (4,) of x, y, h (m) and heading (rad) of single poses, at their stamps from 4 s on."""
    poses = np.column_stack((result["estimate/world.position"], result["estimate/craft.yaw"]))
    true = np.column_stack((result["craft.position"], result["craft.attitude"][:, 2]))
    stamps, times = result["eyes/camera.stamp"], result.times("craft.position")
    late = np.isfinite(poses[:, 0]) & (stamps > 4)
    assert late.sum() > 40
    at_stamps = np.column_stack([np.interp(stamps[late], times, column) for column in true.T])
    return np.mean(poses[late] - at_stamps, axis=0)


@pytest.mark.parametrize("variant", mostly_slow(["geometric", "fused_geometric"]))
def test_an_estimate_that_knows_the_mount_finds_the_craft(tmp_path: Path, variant: str) -> None:
    result = flight(tmp_path, variant, known=True)
    assert errors(result) == pytest.approx((0.0, 0.0, 0.0, 0.0), abs=0.02)
    settled = result["craft.position"][result.times("craft.position") > 4]
    assert np.abs(settled[:, :2]).max() < (0.3 if variant == "geometric" else 0.05)


@pytest.mark.parametrize("variant", mostly_slow(["geometric", "fused_geometric"]))
def test_an_estimate_that_does_not_takes_the_camera_for_the_craft(tmp_path: Path, variant: str) -> None:
    found = errors(flight(tmp_path, variant, known=False))
    assert found[3] == pytest.approx(ANGLES[2], abs=0.01)
    if variant == "geometric":  # the estimate is held at heading 0, so that the craft heads to the left
        where = Rotation.from_euler("Z", -ANGLES[2]).apply(OFFSET)
        assert found[:3] == pytest.approx(where, abs=0.03)
    else:  # the levelled pose believes the inertial unit, so a tilt moves it by the distance
        assert np.abs(found[:2]).min() > 0.05
