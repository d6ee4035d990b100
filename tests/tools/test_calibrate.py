from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from quadvis_blocks.vision._calibration import CameraCalibration
from quadvis_blocks.vision._two_planes import TwoPlanesCalibration

ROOT = Path(__file__).parents[2]
PHOTOGRAPHS = ROOT.parent / "shared" / "data" / "chessboard"
K = np.array([[430.0, 0, 226], [0, 438, 161], [0, 0, 1]])


def calibrate(*arguments, options=(), folder=None, stdout=subprocess.PIPE):
    paths = [str(ROOT), str(ROOT / "blocks"), *filter(None, [os.environ.get("PYTHONPATH")])]
    return subprocess.run(
        [sys.executable, *options, str(ROOT / "tools" / "calibrate"), *map(str, arguments)],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        timeout=120,
    )


def refused(*arguments, **options):
    """Return the one sentence with which the program ends."""
    done = calibrate(*arguments, **options)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr and not done.stdout
    return done.stderr.strip().splitlines()[-1]


@pytest.fixture(scope="module")
def photographs(tmp_path_factory):
    """Three pictures of a 7x5 board with 25 mm squares, 452 x 322, by K, and one of a wall."""
    folder = tmp_path_factory.mktemp("photographs")
    checks = np.pad(np.indices((6, 8)).sum(axis=0) % 2, 1, constant_values=1)
    texture = (40 + 180 * np.kron(checks, np.ones((40, 40)))).astype(np.uint8)
    onto_board = np.array([[1, 0, 0.5 - 200], [0, 1, 0.5 - 160], [0, 0, 1600]])
    onto_samples = np.array([[4, 0, 1.5], [0, 4, 1.5], [0, 0, 1]])
    for i, turn in enumerate([(0.5, 0.1, 0.1), (-0.4, 0.5, 0.0), (0.1, -0.6, 0.4), (-0.5, -0.3, 1.0)]):
        r = cv2.Rodrigues(np.array(turn))[0]
        h = onto_samples @ K @ np.column_stack([r[:, :2], (0.01 * i, -0.01 * i, 0.38)]) @ onto_board
        fine = cv2.warpPerspective(texture, h, (4 * 452, 4 * 322), borderValue=220)
        cv2.imwrite(str(folder / f"view{i}.png"), cv2.resize(fine, (452, 322), interpolation=cv2.INTER_AREA))
    cv2.imwrite(str(folder / "wall.png"), np.full((322, 452), 128, np.uint8))
    cv2.imwrite(str(folder / "small.png"), np.full((240, 320), 128, np.uint8))
    return folder


BOARD = ("--board", "7x5", "--square", "25mm")


def points_file(path, heights=(0.0, 1, 2, 5), tilt=0.0):
    """Write points at these heights before a camera at 27 that looks down, and their pixels."""
    x, y = np.meshgrid(np.linspace(-5, 5, 5), np.linspace(-4, 4, 4))
    points = np.vstack([np.column_stack([x.ravel(), y.ravel(), np.full(x.size, z)]) for z in heights])
    r = cv2.Rodrigues(np.array([tilt, 0, 0]))[0] @ np.diag([1.0, -1, -1])
    e = (points - [0, 0, 27]) @ (K @ r).T
    rows = np.column_stack([points, e[:, :2] / e[:, 2:]])
    path.write_text("x,y,z,rho,gamma\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()))
    return path


def test_help_loads_nothing_heavy():
    done = calibrate("--help", options=["-X", "importtime"])
    assert done.returncode == 0
    assert "examples:" in done.stdout and "--residuals" in done.stdout
    loaded = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in done.stderr.splitlines()}
    assert "argparse" in loaded
    assert not loaded & {"cv2", "numpy", "yaml", "quadvis", "quadvis_blocks"}


def test_the_program_can_be_started_by_its_name():
    assert os.access(ROOT / "tools" / "calibrate", os.X_OK)
    assert (ROOT / "tools" / "calibrate").read_text().startswith("#!/usr/bin/env python3\n")


def test_photographs_give_a_camera_beside_that_of_opencv(photographs, tmp_path):
    pictures = sorted(photographs.glob("view*.png"))
    output, drawing = tmp_path / "camera.yaml", tmp_path / "residuals.png"
    done = calibrate(
        *pictures, *BOARD, "--window", "auto", "--output", output, "--residuals", drawing, "--json"
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    ours, theirs = (np.array(found["cameras"][name]["K"]) for name in ("equations (7)-(10)", "OpenCV"))
    assert ours == pytest.approx(theirs, abs=1)
    assert ours == pytest.approx(K, abs=8)
    assert [view["name"] for view in found["views"]] == [picture.name for picture in pictures]
    assert max(view["rms"] for view in found["views"]) < 0.15
    camera = CameraCalibration.load(output)
    assert camera.size == (452, 322)
    assert camera.matrix == pytest.approx(ours)
    assert camera.views == 4
    assert cv2.imread(str(drawing)).shape == (644, 904, 3)


def test_a_table_for_people_names_every_camera_and_every_view(photographs):
    done = calibrate(*sorted(photographs.glob("view*.png")), *BOARD)
    assert done.returncode == 0, done.stderr
    for word in ("fx", "skew", "equations (7)-(10)", "OpenCV", "k1", "view0.png", "view3.png"):
        assert word in done.stdout


def test_a_reader_that_stops_early_sees_no_traceback(tmp_path):
    points = points_file(tmp_path / "points.csv")
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as closed:
        done = calibrate("--points", points, stdout=closed)
    assert done.returncode == 0 and not done.stderr


def test_a_picture_without_the_board_is_left_out_with_a_warning(photographs):
    done = calibrate(*sorted(photographs.glob("view*.png")), photographs / "wall.png", *BOARD)
    assert done.returncode == 0
    assert "was not found in 1 of 5" in done.stderr and "wall.png" in done.stderr
    assert "wall.png" not in done.stdout


def test_two_pictures_of_the_board_are_too_few(photographs):
    said = refused(photographs / "view0.png", photographs / "view1.png", photographs / "wall.png", *BOARD)
    assert "found in 2 of 3" in said and "3 or more" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "no photographs"),
        (("absent.png", *BOARD), "absent.png"),
        (("note.png", *BOARD), "not a picture"),
        ((".", *BOARD), "cannot read"),
        (("view0.png", "small.png", *BOARD), "one size"),
        (("view0.png",), "--board 9x6"),
        (("view0.png", "--board", "9by6", "--square", "25mm"), "9x6"),
        (("view0.png", "--board", "2x6", "--square", "25mm"), "at least 3x3"),
        (("view0.png", "--board", "7x5", "--square", "25"), "25 mm"),
        (("view0.png", "--board", "7x5", "--square", "0mm"), "above 0"),
        (("view0.png", "--board", "7x5", "--square", "25 s"), "25 s"),
        (("view0.png", *BOARD, "--window", "0"), "1 to 100"),
        (("view0.png", *BOARD, "--points", "points.csv"), "not both"),
        (("view0.png", *BOARD, "--size", "452x322"), "belong to --points"),
        (("--points", "points.csv", *BOARD), "belong to photographs"),
        (("--points", "absent.csv"), "absent.csv"),
        (("--points", "note.png"), "no column"),
        (("--points", "points.csv", "--output", "camera.yaml"), "--size"),
        (("--points", "points.csv", "--projective"), "--two-planes"),
    ],
)
def test_bad_input_ends_with_one_sentence(photographs, arguments, said):
    (photographs / "note.png").write_text("this is not a picture\n")
    points_file(photographs / "points.csv")
    assert said in refused(*arguments, folder=photographs)


def test_a_file_that_cannot_be_written_is_named(tmp_path):
    points = points_file(tmp_path / "points.csv")
    said = refused("--points", points, "--size", "452x322", "--output", tmp_path / "absent" / "camera.yaml")
    assert "cannot write" in said and "camera.yaml" in said


def test_points_in_space_give_the_camera_that_saw_them(tmp_path):
    points, output = points_file(tmp_path / "points.csv"), tmp_path / "camera.yaml"
    done = calibrate("--points", points, "--size", "452x322", "--output", output, "--json")
    assert done.returncode == 0, done.stderr
    cameras = json.loads(done.stdout)["cameras"]
    assert np.array(cameras["equations (7)-(10)"]["K"]) == pytest.approx(K, abs=1e-4)
    assert np.array(cameras["OpenCV, no skew"]["K"]) == pytest.approx(K, abs=0.5)
    assert CameraCalibration.load(output).matrix == pytest.approx(K, abs=1e-4)


def test_points_on_one_plane_are_refused(tmp_path):
    assert "one plane" in refused("--points", points_file(tmp_path / "points.csv", heights=(1.0,)))


def test_points_at_two_heights_give_a_two_planes_calibration(tmp_path):
    points, output = points_file(tmp_path / "points.csv", heights=(1, 6)), tmp_path / "planes.yaml"
    done = calibrate("--points", points, "--two-planes", output)
    assert done.returncode == 0 and not done.stderr
    planes = TwoPlanesCalibration.load(output)
    assert not planes.projective
    assert pytest.approx([0, 0, 27], abs=1e-6) == planes.F
    assert planes.pinhole[0] == pytest.approx(K, abs=1e-4)


def test_a_tilted_board_is_told_and_projective_maps_take_it(tmp_path):
    points, output = points_file(tmp_path / "points.csv", heights=(1, 6), tilt=0.05), tmp_path / "planes.yaml"
    done = calibrate("--points", points, "--two-planes", output)
    assert done.returncode == 0 and "--projective" in done.stderr
    done = calibrate("--points", points, "--two-planes", output, "--projective")
    assert done.returncode == 0 and not done.stderr
    assert TwoPlanesCalibration.load(output).pinhole[0] == pytest.approx(K, abs=1e-3)


@pytest.mark.skipif(
    not PHOTOGRAPHS.is_dir(),
    reason="the chessboard photographs are not beside the repository (../shared/data)",
)
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_photographs_of_opencv_give_its_camera_within_half_a_pixel(tmp_path, side):
    pictures = sorted(PHOTOGRAPHS.glob(f"{side}??.jpg"))
    done = calibrate(
        *pictures, "--board", "9x6", "--square", "25mm", "--output", tmp_path / "camera.yaml", "--json"
    )
    assert done.returncode == 0, done.stderr
    reference = json.loads((PHOTOGRAPHS / "reference_calibration.json").read_text())[side]
    found = json.loads(done.stdout)
    assert len(found["views"]) == 13
    for name in ("equations (7)-(10)", "OpenCV"):
        assert np.array(found["cameras"][name]["K"]) == pytest.approx(np.array(reference["K"]), abs=0.5)
    assert "--window auto" in done.stderr
