"""The program that measures the detector beside its peers, on a few pictures."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import numpy as np
import pytest

from quadvis_vision.trials.scenes import CONDITIONS, draw_pose, homography

PROGRAM = Path(__file__).parents[2] / "tools" / "bench_detector"
SMALL = ("--size", "320x240", "--pictures", "1", "--rounds", "1", "--interpreted")


def run(*arguments, **environment):
    return subprocess.run(
        [sys.executable, str(PROGRAM), *arguments],
        capture_output=True,
        text=True,
        env=os.environ | environment,
        timeout=300,
    )


def cells(text):
    """Return the columns of all rows by their first one."""
    rows = [re.split(r"\s{2,}", line.strip()) for line in text.splitlines()]
    return {row[0]: row[1:] for row in rows if len(row) > 1}


@pytest.fixture(scope="module")
def bench():
    """The program as a module."""
    loader = SourceFileLoader("bench_detector", str(PROGRAM))
    module = module_from_spec(spec_from_loader("bench_detector", loader))
    exec(compile(PROGRAM.read_text(), PROGRAM, "exec"), vars(module))
    return module


@pytest.fixture(scope="module")
def everything():
    done = run(*SMALL)
    assert done.returncode == 0 and not done.stderr
    return done.stdout


@pytest.mark.slow
def test_every_condition_has_a_row_with_what_was_right_and_where_the_circles_were(everything):
    found = cells(everything)
    for name, condition in CONDITIONS.items():
        share, rms, took, *_ = found[name]
        assert share == "100.0%" and float(took) > 0
        assert rms == "-" if condition.missing == 4 else float(rms) < 0.15


@pytest.mark.slow
def test_markers_are_found_in_a_clean_scene_and_not_in_an_empty_one(everything):
    found = cells(everything)
    assert found["clean"][3] == "100.0%" and float(found["clean"][4]) < 0.5
    assert found["empty"][3] == "100.0%" and found["empty"][4] == "-"
    assert found["1 missing"][3] == "-"


@pytest.mark.slow
def test_all_peers_are_timed_on_pictures_in_which_they_see_what_they_look_for(everything):
    found = cells(everything)
    for name in (
        "circle_detector, search",
        "circle_detector, tracking",
        "aruco",
        "SimpleBlobDetector + colour",
    ):
        assert found[name][0] == "100%" and float(found[name][1]) > 0


@pytest.mark.slow
def test_every_figure_that_was_asked_for_is_judged(everything):
    judged = [line.strip() for line in everything.splitlines() if re.match(r"\s+(reached|missed) ", line)]
    with_april = "not installed" not in everything
    assert len(judged) == 4 + 3 + with_april + 1
    reached = sum(line.startswith("reached") for line in judged)
    assert everything.endswith(f"{reached} of {len(judged)} figures reach what is asked\n")


@pytest.mark.slow
def test_without_apriltag_its_row_says_how_to_install_it(tmp_path):
    (tmp_path / "pupil_apriltags.py").write_text("raise ModuleNotFoundError\n")
    done = run("speed", *SMALL, PYTHONPATH=str(tmp_path))
    assert done.returncode == 0 and not done.stderr
    assert cells(done.stdout)["AprilTag"] == ["not installed: pip install pupil-apriltags"]


def test_a_section_that_is_none_is_refused():
    done = run("speeds")
    assert done.returncode == 2
    assert done.stderr == "bench_detector: there is no section 'speeds'; did you mean 'speed'?\n"


def test_a_marker_is_drawn_where_its_corners_are_and_with_its_own_modules(bench):
    """By what a camera sees straight above: whole modules, black where they are black."""
    modules = np.array([[0, 0, 0], [0, 255, 0], [0, 0, 0]], np.uint8)
    picture = np.full((240, 320, 3), 200.0)
    scale = 150 / bench.OUTER  # 150 px wide, its middle between four pixels
    bench.paste(picture, np.array([[scale, 0, 159.5], [0, -scale, 119.5], [0, 0, 1]]), modules)
    expected = np.full((240, 320), 200.0)
    expected[45:195, 85:235] = bench.INK
    expected[95:145, 135:185] = 200
    assert np.abs(picture - expected[..., None]).max() < 1e-3


def test_markers_are_in_the_picture_with_some_ceiling_around_them(bench):
    rng, size = np.random.default_rng(1), (320, 240)
    for pose in bench.draw_flight(rng, size, CONDITIONS["near"], 2):
        corners = bench.project(homography(size, pose), bench.edges(bench.OUTER / 2))
        assert (corners > 5).all() and (corners < np.array(size) - 6).all()


def test_the_order_of_corners_does_not_matter_for_their_errors(bench):
    corners = np.array([(10.0, 10), (50, 12), (48, 55), (9, 50)])
    for found in (corners, np.roll(corners, 1, axis=0), corners[::-1]):
        assert sorted(bench.corner_errors(found + np.array((0.3, 0.4)), corners)) == pytest.approx([0.25] * 4)


def test_the_usual_colour_recipes_find_the_circles_of_a_clean_scene(bench):
    rng, size = np.random.default_rng(2), (320, 240)
    shot = bench.stage.shoot(rng, size, pose=draw_pose(rng, size, CONDITIONS["clean"]))
    for find in (bench.hsv, bench.simple_blobs()):
        assert shot.errors(find(shot.pixels)).max() < 0.5
