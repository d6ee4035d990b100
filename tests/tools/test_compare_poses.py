from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from .script import run_script

ROOT = Path(__file__).parents[2]
PICTURES = ROOT / "diagrams" / "recordings" / "hand_held"
VIDEO = ROOT / "diagrams" / "recordings" / "hand_held.mp4"
ANGLES = slice(3, 6)


def run(tool, *arguments, folder, options=()):
    if not options:
        return run_script(ROOT / "tools" / tool, *arguments, folder=folder)
    paths = [*filter(None, [os.environ.get("PYTHONPATH")]), str(ROOT), str(ROOT / "blocks")]
    return subprocess.run(
        [sys.executable, *options, str(ROOT / "tools" / tool), *map(str, arguments)],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        timeout=120,
    )


def compare(*arguments, **options):
    return run("compare_poses", *arguments, **options)


def found(*arguments, folder):
    done = compare(*arguments, "--json", folder=folder)
    assert done.returncode == 0, done.stderr
    said = json.loads(done.stdout)
    return said, {name: np.array(values, dtype=float) for name, values in said["poses"].items()}


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    """What the program says of the recording that it plays without arguments."""
    return found(folder=tmp_path_factory.mktemp("recording"))


def refused(*arguments, folder):
    """Return the one sentence with which the program ends."""
    done = compare(*arguments, folder=folder)
    assert done.returncode == 2
    assert "Traceback" not in done.stderr and not done.stdout
    assert done.stderr.startswith("compare_poses: ") and done.stderr.count("\n") == 1
    return done.stderr


def test_help_loads_nothing_heavy(tmp_path):
    done = compare("--help", folder=tmp_path, options=["-X", "importtime"])
    assert done.returncode == 0 and "examples:" in done.stdout
    loaded = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in done.stderr.splitlines()}
    assert "argparse" in loaded
    assert not loaded & {"cv2", "numpy", "matplotlib", "yaml", "quadvis_blocks", "quadvis_vision"}


def test_without_arguments_it_plays_the_recording_prints_the_table_and_draws_the_figure(tmp_path):
    done = compare(folder=tmp_path)
    assert done.returncode == 0 and not done.stderr
    lines = done.stdout.splitlines()
    assert lines[0] == "30 pictures; poses: 30 by n_points, 30 by plane"
    rows = [line.split() for line in lines if line.strip()[:1].isdigit()][1:]
    assert [row[0] for row in rows] == ["1", "11", "20", "30"]
    assert {len(row) for row in rows} == {13}
    assert "n_points - plane, rms of 30 pictures: x " in done.stdout and "z ratio 1." in done.stdout
    assert cv2.imread(str(tmp_path / "runs" / "comparison.png")) is not None


@pytest.mark.slow
def test_rendered_pictures_are_compared_with_the_true_poses(tmp_path):
    said, methods = found("--rendered", folder=tmp_path)
    assert next(iter(methods)) == "truth" and len(methods) >= 3
    truth = methods.pop("truth")
    # The first tick of record.yaml: 3 m below the target, level. Later it turns by up to 20 deg.
    assert truth[0] == pytest.approx([0, 0, 3, 0, 0, 0])
    for values in methods.values():
        assert np.abs(values - truth)[:, :3].max() < 0.01
        assert np.abs(values - truth)[:, ANGLES].max() < np.radians(0.2)
    pairs = {(pair["first"], pair["second"]) for pair in said["differences"]}
    assert {("truth", "n_points"), ("truth", "plane"), ("n_points", "plane")} <= pairs


@pytest.mark.slow
def test_both_methods_of_the_paper_find_the_same_attitude(recording):
    said, _ = recording
    (pair,) = [p for p in said["differences"] if (p["first"], p["second"]) == ("n_points", "plane")]
    assert pair["pictures"] == 30
    assert max(pair["rms"][ANGLES]) < 1e-12
    assert np.array(pair["z_ratios"]) == pytest.approx(1, abs=1e-3)


@pytest.mark.slow
def test_the_radius_of_the_circles_reaches_the_detector(tmp_path):
    sizes = ("--rendered", "--side", "50 cm", "--radius", "6 cm", "--pictures", "1")
    _, methods = found(*sizes, folder=tmp_path)
    truth = methods.pop("truth")
    for values in methods.values():
        assert np.abs(values - truth)[:, :3].max() < 0.04


def test_pictures_without_any_pose_are_a_failed_run(tmp_path):
    (tmp_path / "pictures").mkdir()
    for number in range(2):
        cv2.imwrite(
            str(tmp_path / "pictures" / f"{number}.png"), np.full((322, 452, 3), 200 + number, np.uint8)
        )
    done = compare("--folder", "pictures", folder=tmp_path)
    assert done.returncode == 1 and not done.stdout
    assert "no method finds a pose in any of the 2 pictures" in done.stderr


@pytest.mark.slow
def test_a_folder_of_any_length_is_played_to_its_end(tmp_path):
    folder = tmp_path / "pictures: 7 #1"
    folder.mkdir()
    for number, path in enumerate(sorted(PICTURES.iterdir())[:7] * 6, 1):
        shutil.copy(path, folder / f"{number}.jpg")
    said, methods = found("--folder", folder.name, "--pictures", "42", folder=tmp_path)
    assert len(said["times"]) == 42
    # The same seven pictures again and again.
    for values in methods.values():
        assert values[7:14] == pytest.approx(values[35:], abs=1e-3)


@pytest.mark.slow
def test_a_video_is_played_to_its_end(tmp_path, recording):
    said, methods = found("--video", VIDEO, folder=tmp_path)
    _, pictures = recording
    assert len(said["times"]) == 30
    assert methods["plane"] == pytest.approx(pictures["plane"], abs=0.04)  # the video is compressed


@pytest.mark.slow
def test_a_camera_with_twice_the_focal_length_sees_everything_twice_as_far(tmp_path, recording):
    text = (ROOT / "diagrams" / "calib" / "camera.yaml").read_text()
    (tmp_path / "tele.yaml").write_text(text.replace("430, 2", "860, 4").replace("438", "876"))
    _, plain = recording
    _, tele = found("--pictures", "1", "--calibration", "tele.yaml", folder=tmp_path)
    # The first picture is level, where nothing else changes.
    for name, values in plain.items():
        assert tele[name][0, 2] / values[0, 2] == pytest.approx(2, abs=1e-3)


@pytest.mark.slow
def test_a_parameter_of_one_method_can_be_replaced(tmp_path):
    text = (ROOT / "diagrams" / "calib" / "camera.yaml").read_text()
    (tmp_path / "tele.yaml").write_text(text.replace("430, 2", "473, 2.2").replace("438", "481.8"))
    said, _ = found("--set", "n_points.calibration=tele.yaml", folder=tmp_path)
    (pair,) = [p for p in said["differences"] if (p["first"], p["second"]) == ("n_points", "plane")]
    # Ten per cent more focal length, ten per cent farther, as in the paper's figure 3.
    assert np.mean(pair["z_ratios"]) == pytest.approx(1.1, abs=0.01)


@pytest.mark.slow
def test_the_comparison_of_the_paper_with_a_calibration_of_its_own_for_each_method(tmp_path):
    # Points on two planes before the camera of (38), looked at from above, and pixels that are 0.05 px off.
    matrix = np.array([[430.0, 2, 226], [0, 438, 161], [0, 0, 1]])
    x, y = np.meshgrid(np.linspace(-1.2, 1.2, 9), np.linspace(-0.8, 0.8, 7))
    points = np.vstack([np.column_stack((x.ravel(), y.ravel(), np.full(x.size, z))) for z in (0.0, 0.5)])
    e = (points - [0, 0, 3]) @ (matrix @ np.diag([1.0, -1, -1])).T
    pixels = e[:, :2] / e[:, 2:] + np.random.default_rng(1).normal(0, 0.05, (len(e), 2))
    rows = "\n".join(",".join(map(repr, row)) for row in np.column_stack((points, pixels)).tolist())
    (tmp_path / "points.csv").write_text(f"x,y,z,rho,gamma\n{rows}\n")
    arguments = ("--points", "points.csv", "--size", "452x322")
    written = ("--two-planes", "planes.yaml", "--output", "camera.yaml")
    assert run("calibrate", *arguments, *written, folder=tmp_path).returncode == 0
    own = ("--set", "n_points.rays=two_planes", "--set", "n_points.calibration=planes.yaml")
    said, methods = found("--rendered", *own, "--set", "plane.calibration=camera.yaml", folder=tmp_path)
    for name in ("n_points", "plane"):
        assert np.abs(methods[name] - methods["truth"])[:, :3].max() < 0.03
    (pair,) = [p for p in said["differences"] if (p["first"], p["second"]) == ("n_points", "plane")]
    # They agree as their calibrations do, and no better: the attitude is no longer the same.
    assert max(pair["rms"][:3]) < 0.03
    assert max(pair["rms"][ANGLES]) > 1e-6


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--folder", "absent"), "folder 'absent' does not exist"),
        (("--video", "absent.mp4"), "file 'absent.mp4' does not exist"),
        (("--folder", "a", "--video", "b"), "--folder and --video exclude each other; keep one"),
        (("--calibration", "absent.yaml"), "absent.yaml"),
        (("--pictures", "31"), "there is no picture 31; there are 30"),
        (("--pictures", "0"), "not a list of pictures"),
        (("--pictures", "1,,2"), "not a list of pictures"),
        (("--side", "1"), "did you mean '1 m'?"),
        (("--set", "plane.sides=1 m"), "sides"),
        (("--diagram", ROOT / "diagrams" / "record.yaml", "--set", "folder=made"), "needs two or more"),
        (("--figure", "file/figure.png"), "cannot write the figure"),
        (("--figre", "x.png"), "there is no option '--figre'; did you mean '--figure'?"),
        (("x.png",), "'x.png' is one too many; write 'compare_poses'"),
    ],
)
def test_bad_input_ends_with_one_sentence(tmp_path, arguments, said):
    (tmp_path / "file").touch()
    assert said in refused(*arguments, folder=tmp_path)


def test_pictures_of_another_size_than_the_calibration_are_refused_by_their_headers(tmp_path):
    (tmp_path / "pictures").mkdir()
    cv2.imwrite(str(tmp_path / "pictures" / "1.png"), np.zeros((480, 640, 3), np.uint8))
    said = refused("--folder", "pictures", folder=tmp_path)
    assert "1.png is 640x480 but" in said and "camera.yaml is for 452x322 px" in said


@pytest.mark.slow
def test_the_calibration_of_the_pictures_is_the_detectors_too(tmp_path):
    (tmp_path / "pictures").mkdir()
    for number in (1, 2, 3):
        picture = cv2.imread(str(PICTURES / f"{number:06d}.jpg"))
        wide = cv2.copyMakeBorder(picture, 0, 0, 0, 48, cv2.BORDER_REPLICATE)
        cv2.imwrite(str(tmp_path / "pictures" / f"{number}.png"), wide)
    camera = (ROOT / "diagrams" / "calib" / "camera.yaml").read_text()
    (tmp_path / "wide.yaml").write_text(camera.replace("[452, 322]", "[500, 322]"))
    _, methods = found("--folder", "pictures", "--calibration", "wide.yaml", folder=tmp_path)
    assert all(np.isfinite(values).all() for values in methods.values())


@pytest.mark.slow
def test_orientation_tags_are_ignored_and_what_cannot_be_read_is_told(tmp_path, recording):
    shutil.copytree(PICTURES, tmp_path / "pictures")
    first, second = (tmp_path / "pictures" / f"{number:06d}.jpg" for number in (1, 2))
    data = first.read_bytes()
    asks = b"Exif\0\0MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0"
    first.write_bytes(
        data[:2] + b"\xff\xe1" + (2 + len(asks)).to_bytes(2, "big") + asks + data[2:] + bytes(99)
    )
    second.write_bytes(second.read_bytes()[:3000])
    _, plain = recording
    done = compare("--folder", "pictures", "--json", folder=tmp_path)
    assert done.returncode == 0
    assert "000002.jpg is cut short" in done.stderr and "000001.jpg asks to be turned" in done.stderr
    for name, values in json.loads(done.stdout)["poses"].items():
        seen = np.array(values, dtype=float)
        assert np.isnan(seen[1]).all()
        assert np.array_equal(seen[0], plain[name][0])  # after a gap circles are searched for, not followed
        assert np.isfinite(seen[2:]).all()


def test_the_program_can_be_started_by_its_name():
    assert os.access(ROOT / "tools" / "compare_poses", os.X_OK)
    assert (ROOT / "tools" / "compare_poses").read_text().startswith("#!/usr/bin/env python3\n")
