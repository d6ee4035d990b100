"""The numbers that the pose methods are to reach, as `tools/bench_pose` measures them beside their peers."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from pathlib import Path

import cv2
import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = ROOT / "tools" / "bench_pose"
PHOTOGRAPHS = ROOT.parent / "shared" / "data" / "chessboard"
POSES = 1000

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def bench():
    """The program as a module."""
    spec = importlib.util.spec_from_loader("bench_pose", SourceFileLoader("bench_pose", str(PROGRAM)))
    module = importlib.util.module_from_spec(spec)
    exec(compile(PROGRAM.read_text(), PROGRAM, "exec"), vars(module))
    return module


@pytest.fixture(scope="module")
def found(bench):
    """Rms errors by noise (px) and method, over one sample of poses."""
    rows = {}
    for noise in bench.NOISES:
        cases = bench.draw(POSES, noise, 1)
        rows[noise] = {name: bench.errors(method, cases) for name, method in bench.methods(noise).items()}
    return rows


def best_of_opencv(bench, rows):
    return min(rows[f"cv2 {name}"][0]["xy"] for name in bench.OPENCV)


# What a study of its own found for poses of this kind: xy in units.
STUDY = {
    0.1: {"cv2 SQPNP": 0.328, "cv2 IPPE_SQUARE": 0.581, "n_points": 0.485, "plane": 0.484, "imu map": 0.235},
    0.5: {"cv2 SQPNP": 1.82, "cv2 IPPE_SQUARE": 2.49, "n_points": 2.41, "plane": 2.40, "imu map": 0.344},
    1.0: {"cv2 SQPNP": 4.06, "cv2 IPPE_SQUARE": 4.79, "n_points": 4.68, "plane": 4.66, "imu map": 0.355},
}


@pytest.mark.parametrize("noise", STUDY)
def test_the_sample_is_like_that_of_an_independent_study(found, noise):
    for name, xy in STUDY[noise].items():
        assert found[noise][name][0]["xy"] == pytest.approx(xy, rel=0.1)


@pytest.mark.parametrize(("noise", "times"), [(0.1, 1.35), (0.5, 5.0), (1.0, 10.0)])
def test_with_a_tilt_known_to_half_a_degree_the_position_is_this_much_better_than_opencv_s_best(
    bench, found, noise, times
):
    assert best_of_opencv(bench, found[noise]) > times * found[noise]["imu map"][0]["xy"]


@pytest.mark.parametrize("noise", [0.1, 0.5, 1.0])
def test_without_a_tilt_gauss_newton_equals_opencv_s_best_within_a_hundredth(bench, found, noise):
    rows = found[noise]
    for name in ("n_points", "plane"):
        assert rows[f"{name} + gauss_newton"][0]["xy"] < 1.01 * best_of_opencv(bench, rows)


@pytest.mark.parametrize("noise", [0.1, 0.5, 1.0])
def test_weighing_is_never_worse_than_the_picture_or_the_tilt_alone(found, noise):
    rows = {name: rms for name, (rms, _) in found[noise].items()}
    for error in ("xy", "z", "yaw", "tilt"):
        for alone in ("imu level", "plane + gauss_newton"):
            assert rows["imu map"][error] < 1.01 * rows[alone][error]


@pytest.mark.parametrize("noise", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("mode", ["imu level", "imu map"])
def test_covariances_are_consistent(found, noise, mode):
    _, squares = found[noise][mode]
    # The sum of the squared errors over their covariance is chi-square with four degrees of freedom a pose;
    # 3.5 standard deviations either way.
    bound = 3.5 * np.sqrt(2 * 4 * POSES)
    assert abs(squares.sum() - 4 * POSES) < bound
    assert (squares > 13.28).mean() == pytest.approx(0.01, abs=0.008)  # the hundredth part beyond 13.28


def test_two_circles_of_four_are_nearly_as_good(bench):
    cases = bench.draw(POSES, 0.5, 1)
    for mode, diagonal, adjacent in (("level", 1.02, 1.035), ("map", 1.05, 1.08)):
        xy = {
            name: bench.errors(bench.with_tilt(mode, 0.5, rows), cases)
            for name, rows in bench.SUBSETS.items()
        }
        four = xy["4 circles"][0]["xy"]
        assert xy["2 diagonal"][0]["xy"] < diagonal * four
        assert xy["2 adjacent"][0]["xy"] < adjacent * four
        for _, squares in xy.values():
            assert squares.mean() == pytest.approx(4, abs=0.25)


def test_the_levelled_pose_takes_less_time_than_ippe_square(bench):
    """It takes 0.44 of it; load spreads the ratio."""
    cv2.setNumThreads(1)
    taken = bench.times(bench.draw(30, 0.5, 1), rounds=25)
    assert taken["imu level"][1] < 1


@pytest.mark.skipif(not PHOTOGRAPHS.is_dir(), reason="no photographs in ../shared/data/chessboard")
@pytest.mark.parametrize(("side", "mm", "degrees"), [("left", 1.6, 0.3), ("right", 2.6, 0.47)])
def test_on_photographs_four_corners_refined_are_better_than_ippe(bench, side, mm, degrees):
    found = bench.from_chessboard(PHOTOGRAPHS, side)
    refined, ippe = found["plane + gauss_newton"], found["cv2 IPPE"]
    assert refined[0] < mm and refined[1] < degrees
    assert refined[0] < 0.8 * ippe[0] and refined[1] < 0.8 * ippe[1]


def run(*arguments):
    paths = [str(ROOT), str(ROOT / "blocks"), *filter(None, [os.environ.get("PYTHONPATH")])]
    return subprocess.run(
        [sys.executable, str(PROGRAM), *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        timeout=120,
    )


def test_anyone_can_run_it(tmp_path):
    done = run("--poses", "20", "--picture", "452x322", "--photographs", str(tmp_path))
    assert done.returncode == 0 and not done.stderr
    for word in ("cv2 IPPE_SQUARE", "plane + gauss_newton", "imu map", "2 adjacent", "no photographs"):
        assert word in done.stdout


def test_a_size_that_is_none_is_refused():
    done = run("--picture", "big")
    assert done.returncode == 2
    assert (
        done.stderr
        == "bench_pose: --picture: 'big' is not two numbers from 1 to 9999; write --picture 320x240\n"
    )
