"""The reference experiment: hover statistics with 0.3 px of noise for a camera, and with the rendered one.

The expected numbers are of an independent simulation of the same loop: 30 seeds, RMS over both axes.
"""

from pathlib import Path

import numpy as np
import pytest

import quadvis

pytestmark = pytest.mark.slow

HOVER = Path(__file__).parents[2] / "diagrams" / "hover.yaml"
# The statistics were taken without the edges of the picture: the same camera with a larger sensor.
WIDE = (
    "size: [4520, 3220]\nmatrix: [[430, 2, 2260], [0, 438, 1610], [0, 0, 1]]\ndistortion: [0, 0, 0, 0, 0]\n"
)
QUIET = {"gust.rms": "{value: [0, 0, 0], unit: m/s}", "imu.drift": "0 rad", "imu.angle_noise": "0 rad",
         "imu.rate_noise": "0 rad/s"}  # fmt: skip
SEEDS = range(1, 11)


def mean_rms(folder, bandwidth, **more):
    (folder / "wide.yaml").write_text(WIDE)
    settings = {"bandwidth": bandwidth, "eyes.calibration": str(folder / "wide.yaml"),
                "pose.calibration": str(folder / "wide.yaml"), **more}  # fmt: skip
    found = []
    for seed in SEEDS:
        result = quadvis.load(HOVER, variant="geometric", settings=settings, seed=seed).run()
        position = result["craft.position"][result.times("craft.position") >= 40, :2]
        found.append(np.sqrt(np.mean(position**2)))
    return np.mean(found)


@pytest.mark.parametrize(
    ("bandwidth", "expected"), [("1 rad/s", 0.259), ("2 rad/s", 0.123), ("2.5 rad/s", 0.110)]
)
def test_nominal_noise_gives_the_hover_of_the_reference(tmp_path, bandwidth, expected):
    assert mean_rms(tmp_path, bandwidth) == pytest.approx(expected, rel=0.25)


@pytest.mark.parametrize(
    ("bandwidth", "expected"), [("1 rad/s", 0.048), ("2 rad/s", 0.073), ("2.5 rad/s", 0.082)]
)
def test_pixel_noise_alone_gives_the_hover_of_the_reference(tmp_path, bandwidth, expected):
    assert mean_rms(tmp_path, bandwidth, **QUIET) == pytest.approx(expected, rel=0.25)


@pytest.mark.parametrize("variant", [None, "plane"])
def test_the_rendered_camera_holds_a_satisfactory_hover(variant):
    result = quadvis.load(HOVER, variant=variant).run()
    late = result.times("craft.position") >= 40
    position, yaw = result["craft.position"][late, :2], result["craft.attitude"][late, 2]
    assert result.passed
    assert not result["eyes/detector.lost"].any()
    assert np.sqrt(np.mean(position**2)) <= 0.15
    assert np.abs(position).max() <= 0.45
    assert np.degrees(np.sqrt(np.mean(yaw**2))) <= 2.0
