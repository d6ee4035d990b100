from __future__ import annotations

import datetime
import json
import os
import re
import shutil
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import pytest

from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.two_planes import TwoPlanesCalibration

from .script import run_script

ROOT = Path(__file__).parents[2]
PHOTOGRAPHS = ROOT.parent / "shared" / "data" / "chessboard"
K = np.array([[430.0, 0, 226], [0, 438, 161], [0, 0, 1]])


def calibrate(*arguments, options=(), folder=None, stdout=subprocess.PIPE):
    if not options and stdout == subprocess.PIPE:
        return run_script(ROOT / "tools" / "calibrate", *arguments, folder=folder)
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
    assert done.stderr.startswith("calibrate: ") and done.stderr.count("\n") == 1
    return done.stderr


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
    assert not loaded & {"cv2", "numpy", "yaml", "quadvis_blocks", "quadvis_vision"}


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
    assert camera.evidence.errors == pytest.approx([view["rms"] for view in found["views"]])
    assert camera.evidence.rms == pytest.approx(found["cameras"]["equations (7)-(10)"]["rms"])
    assert datetime.date.fromisoformat(camera.evidence.date) <= datetime.date.today()
    assert len(camera.evidence.points) == 40
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


def ours(done):
    """Return what we found; OpenCV's threads sum up in any order."""
    said = json.loads(done.stdout)
    return [said["cameras"][name] for name in ("equations (7)-(10)", "bundle adjustment")], [
        (view["name"], view["rms"]) for view in said["views"]
    ]


def turned_on_show(path, orientation=6):
    """Let a JPEG ask to be turned when it is shown."""
    asks = b"Exif\0\0MM" + struct.pack(">HIHHHIHHI", 42, 8, 1, 274, 3, 1, orientation, 0, 0)
    data = path.read_bytes()
    path.write_bytes(data[:2] + b"\xff\xe1" + struct.pack(">H", 2 + len(asks)) + asks + data[2:])


def test_orientation_tags_and_bytes_behind_the_end_change_nothing_but_a_note(photographs, tmp_path):
    for view in photographs.glob("view*.png"):
        cv2.imwrite(str(tmp_path / view.with_suffix(".jpg").name), cv2.imread(str(view)))
    pictures = sorted(tmp_path.glob("*.jpg"))
    plain = calibrate(*pictures, *BOARD, "--json")
    turned_on_show(pictures[1])
    turned_on_show(pictures[3], 3)
    pictures[2].write_bytes(pictures[2].read_bytes() + bytes(512))
    changed = calibrate(*pictures, *BOARD, "--json")
    assert changed.returncode == 0, changed.stderr
    assert ours(plain) == ours(changed)
    (note,) = [line for line in changed.stderr.splitlines() if "orientation" in line]
    assert note.startswith("warning: view1.jpg, view3.jpg ask to be turned")
    assert "orientation" not in plain.stderr


def test_a_picture_that_is_in_the_list_twice_counts_once(photographs, tmp_path):
    pictures = sorted(photographs.glob("view*.png"))
    copies = [tmp_path / "copy.png", tmp_path / "saved again.bmp"]
    shutil.copy(pictures[0], copies[0])
    cv2.imwrite(str(copies[1]), cv2.imread(str(pictures[2])))
    once = calibrate(*pictures, *BOARD, "--json")
    done = calibrate(*pictures, pictures[1], *copies, *BOARD, "--json")
    assert done.returncode == 0
    assert ours(done) == ours(once)
    assert [view["name"] for view in json.loads(done.stdout)["views"]] == [file.name for file in pictures]
    told = [line for line in done.stderr.splitlines() if "same picture" in line]
    assert len(told) == 3 and all("counts once" in line for line in told)
    assert str(copies[0]) in told[1] and str(pictures[0]) in told[1]


@pytest.fixture(scope="module")
def one_angle(tmp_path_factory):
    """Pictures of a board that is always tilted the same way, by K."""
    folder = tmp_path_factory.mktemp("one angle")
    for number, turn in enumerate((0.0, 0.02, -0.02, 0.04)):
        cv2.imwrite(str(folder / f"{number}.png"), board(0.02 * number, 0.35, turn, 0.3))
    return sorted(folder.glob("*.png"))


def test_views_from_one_angle_are_told_beside_the_camera_and_in_its_file(one_angle, tmp_path):
    output = tmp_path / "camera.yaml"
    done = calibrate(*one_angle, *BOARD, "--window", "auto", "--output", output)
    assert done.returncode == 0, done.stderr
    (said,) = [line for line in done.stderr.splitlines() if "undetermined" in line]
    assert said.startswith(
        "warning: these views leave the camera undetermined: errors of 0.25 px in them change fx"
    )
    assert said.endswith("tilt the board more ways, by 20 deg and more")
    assert f"# {said}\n" in output.read_text()
    assert "# standard deviation: " in output.read_text()
    CameraCalibration.load(output)
    as_json = json.loads(calibrate(*one_angle, *BOARD, "--window", "auto", "--json").stdout)
    assert said.removeprefix("warning: ") in as_json["warnings"]


def test_standard_deviations_stand_beside_the_values(photographs, tmp_path):
    pictures = sorted(photographs.glob("view*.png"))
    output = tmp_path / "camera.yaml"
    done = calibrate(*pictures, *BOARD, "--window", "auto", "--output", output)
    rows = [line.split() for line in done.stdout.splitlines() if line.startswith("standard deviation")]
    assert len(rows) == 2 and rows[0][4] == "-"  # the skew is held
    told = json.loads(calibrate(*pictures, *BOARD, "--window", "auto", "--json").stdout)[
        "standard deviations"
    ]
    assert [float(rows[0][index]) for index in (2, 3, 5, 6)] == pytest.approx(
        [told[name] for name in ("fx", "fy", "cx", "cy")], abs=6e-4
    )
    for name, text in zip(("k1", "k2", "p1", "p2", "k3"), rows[1][2:], strict=True):
        assert text == "-" if name not in told else float(text) == pytest.approx(told[name], abs=6e-6)
    assert 0 < told["fx"] < 2 and "undetermined" not in done.stderr
    head = output.read_text().partition("size:")[0]
    assert "# standard deviation: " in head and "warning" not in head


def test_points_at_almost_one_depth_are_told_and_others_have_deviations(tmp_path):
    done = calibrate("--points", points_file(tmp_path / "points.csv"), "--json")
    assert list(json.loads(done.stdout)["standard deviations"]) == ["fx", "fy", "cx", "cy", "skew"]
    assert not done.stderr
    near = points_file(tmp_path / "near.csv", heights=(0.0, 0.1))
    done = calibrate("--points", near, "--two-planes", tmp_path / "planes.yaml")
    assert done.returncode == 0
    assert "these points leave the camera undetermined" in done.stderr
    assert "more depths" in done.stderr
    assert "# warning: these points leave the camera undetermined" in (tmp_path / "planes.yaml").read_text()


def test_one_picture_three_times_is_one_view(photographs):
    said = refused(*[photographs / "view0.png"] * 3, *BOARD)
    assert "found in 1 of 1 pictures; it takes 3 or more" in said and "same picture" in said


def test_one_picture_at_two_heights_is_refused(photographs):
    said = refused(*["view0.png"] * 2, *BOARD, "--heights", "0cm,1cm", folder=photographs)
    assert "found in 1 of 1 pictures; it takes 2 or more" in said and "same picture" in said


def test_two_pictures_of_the_board_are_too_few(photographs):
    said = refused(photographs / "view0.png", photographs / "view1.png", photographs / "wall.png", *BOARD)
    assert "found in 2 of 3" in said and "3 or more" in said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "no photographs"),
        (("--bord", "9x6"), "there is no option '--bord'; did you mean '--board'?"),
        (("view0.png", "--board"), "--board needs a value; write --board 9x6"),
        (
            ("view0.png", "--board", "0x6"),
            "--board: '0x6' is not two numbers from 1 to 9999; write --board 9x6",
        ),
        (("absent.png", *BOARD), "absent.png"),
        (("note.png", *BOARD), "not a picture"),
        (("cut.png", *BOARD), "cut.png is damaged, or cut short"),
        (("/dev/zero", *BOARD), "a device or a pipe"),
        (("huge.png", *BOARD), "huge.png declares 30000 x 30000 px; at most 64 million"),
        ((".", *BOARD), "cannot read"),
        (("view0.png", "small.png", *BOARD), "one size"),
        (("view0.png",), "--board 9x6"),
        (("view0.png", "--board", "9by6", "--square", "25mm"), "9x6"),
        (("view0.png", "--board", "2x6", "--square", "25mm"), "at least 3x3"),
        (("view0.png", "--board", "7x5", "--square", "25"), "25 mm"),
        (("view0.png", "--board", "7x5", "--square", "0mm"), "above 0"),
        (("view0.png", "--board", "7x5", "--square", "25 s"), "25 s"),
        (("view0.png", *BOARD, "--window", "0"), "1 to 100; write --window PX|auto"),
        (("view0.png", *BOARD, "--points", "points.csv"), "not both"),
        (("view0.png", *BOARD, "--size", "452x322"), "belong to --points"),
        (("view0.png", *BOARD, "--picture", "small.png"), "belong to --points"),
        (("view0.png", *BOARD, "--two-planes", "planes.yaml"), "--heights 0cm,10cm"),
        (("view0.png", "view1.png", *BOARD, "--heights", "0cm"), "1 heights for 2 photographs"),
        (("view0.png", "view1.png", *BOARD, "--heights", "0,1"), "no unit"),
        (("view0.png", "wall.png", *BOARD, "--heights", "0cm,1cm"), "found in 1 of 2 pictures; it takes 2"),
        (("view0.png", "view1.png", *BOARD, "--heights", "0cm,1cm", "--skew"), "without --heights"),
        (("--points", "points.csv", *BOARD), "belong to photographs"),
        (("--points", "points.csv", "--size", "452x322", "--picture", "small.png"), "not both"),
        (("--points", "points.csv", "--picture", "note.png"), "not a picture"),
        (("--points", "points.csv", "--size", "320x240", "--output", "camera.yaml"), "outside a picture"),
        (("--points", "absent.csv"), "absent.csv"),
        (("--points", "note.png"), "no column"),
        (("--points", "points.csv", "--output", "camera.yaml"), "--size"),
        (("--points", "points.csv", "--projective"), "--two-planes"),
    ],
)
def test_bad_input_ends_with_one_sentence(photographs, arguments, said):
    (photographs / "note.png").write_text("this is not a picture\n")
    points_file(photographs / "points.csv")
    whole = (photographs / "view0.png").read_bytes()
    (photographs / "cut.png").write_bytes(whole[:5000] + bytes(5000))
    head = whole[12:16] + struct.pack(">II", 30_000, 30_000) + whole[24:29]
    (photographs / "huge.png").write_bytes(
        whole[:12] + head + struct.pack(">I", zlib.crc32(head)) + whole[33:]
    )
    assert said in refused(*arguments, folder=photographs)


@pytest.mark.parametrize("option", ["--output", "--residuals", "--two-planes"])
@pytest.mark.parametrize("how", ["same", "spelling", "symbolic", "hard", "other kind"])
def test_nothing_that_is_read_and_no_other_kind_of_file_is_written_over(photographs, tmp_path, option, how):
    views = []
    for i in range(4):
        views.append(tmp_path / f"view{i}.png")
        views[-1].write_bytes((photographs / f"view{i}.png").read_bytes())
    out = {"same": views[0], "spelling": tmp_path / ".." / tmp_path.name / "view0.png"}.get(
        how, tmp_path / "out"
    )
    match how:
        case "symbolic":
            out.symlink_to(views[0])
        case "hard":
            out.hardlink_to(views[0])
        case "other kind":
            out.write_text("quadvis: 1\nname: x\n")
    before = {path: path.read_bytes() for path in tmp_path.iterdir()}
    heights = ("--heights", "0cm,1cm,2cm,3cm") if option == "--two-planes" else ()
    said = refused(*views, *BOARD, *heights, option, out)
    assert "cannot write" in said
    assert ("another kind" in said) == (how == "other kind")
    assert {path: path.read_bytes() for path in tmp_path.iterdir()} == before


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
    camera = CameraCalibration.load(output)
    assert camera.matrix == pytest.approx(K, abs=1e-4)
    # The points that the file keeps are in the camera's own axes, in front of it.
    assert camera.evidence.points[:, 2].min() == pytest.approx(22, abs=1e-3)


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
    assert planes.evidence.rms == pytest.approx(0, abs=1e-6) and planes.evidence.errors.shape == (2,)
    assert datetime.date.fromisoformat(planes.evidence.date) <= datetime.date.today()
    assert planes.unit is None


def test_the_residuals_of_both_calibrations_are_drawn_over_the_picture(tmp_path):
    points = points_file(tmp_path / "points.csv", heights=(1, 6))
    grey = np.full((322, 452), 60, np.uint8)
    grey[:, 200:] = 200
    cv2.imwrite(str(tmp_path / "photo.png"), grey)
    names = ("--points", points, "--picture", "photo.png", "--residuals", "residuals.png")
    assert calibrate(*names, "--two-planes", "planes.yaml", folder=tmp_path).returncode == 0
    drawn = cv2.imread(str(tmp_path / "residuals.png"))
    assert drawn.shape == (644, 1808, 3)
    for left in (0, 904):
        assert drawn[20, left + 100].mean() < drawn[20, left + 800].mean() - 20


def board(height, tilt=0.0, turn=0.0, lean=0.0):
    """Return a noisy picture by K of a 7x5 board with 25 mm squares, `height` m nearer than 0.42 m."""
    checks = np.pad(np.indices((6, 8)).sum(axis=0) % 2, 1, constant_values=1)
    texture = (40 + 180 * np.kron(checks, np.ones((40, 40)))).astype(np.uint8)
    onto_board = np.array([[1, 0, 0.5 - 200], [0, 1, 0.5 - 160], [0, 0, 1600]])
    onto_samples = np.array([[4, 0, 1.5], [0, 4, 1.5], [0, 0, 1]])
    r = cv2.Rodrigues(np.array([tilt, lean, 0.0]))[0] @ cv2.Rodrigues(np.array([0, 0, turn]))[0]
    shift = np.array([0, 0, 0.42]) - r[:, 2] * height
    h = onto_samples @ K @ np.column_stack([r[:, :2], shift]) @ onto_board
    fine = cv2.warpPerspective(texture, h, (4 * 452, 4 * 322), borderValue=220)
    picture = cv2.resize(fine, (452, 322), interpolation=cv2.INTER_AREA)
    noise = np.random.default_rng(1).normal(0, 2, picture.shape)
    return np.clip(picture + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("turn", [0.1, 1.5, 3.0])
@pytest.mark.parametrize("tilt", [0.0, 0.04])
def test_photographs_of_a_board_at_two_heights_give_both_calibrations(tmp_path, turn, tilt):
    for name, height in (("low.png", 0.0), ("high.png", 0.1)):
        cv2.imwrite(str(tmp_path / name), board(height, tilt, turn))
    arguments = ["low.png", "high.png", *BOARD, "--window", "auto", "--heights", "0 mm, 10 cm"]
    arguments += ["--two-planes", "planes.yaml", "--output", "camera.yaml", "--residuals", "residuals.png"]
    done = calibrate(*arguments, *(["--projective"] if tilt else []), folder=tmp_path)
    assert done.returncode == 0 and not done.stderr, done.stderr
    assert "low.png" in done.stdout and "two planes" in done.stdout
    camera = CameraCalibration.load(tmp_path / "camera.yaml")
    planes = TwoPlanesCalibration.load(tmp_path / "planes.yaml")
    assert camera.size == (452, 322)
    assert camera.matrix == pytest.approx(K, abs=4) and planes.pinhole[0] == pytest.approx(K, abs=4)
    assert (planes.z1, planes.z2, planes.unit) == (0, 0.1, "m")
    assert planes.F[2] == pytest.approx(0.42, abs=0.005)
    assert max(camera.evidence.rms, planes.evidence.rms) < 0.2
    assert cv2.imread(str(tmp_path / "residuals.png")).shape == (644, 1808, 3)


def test_the_tilt_of_a_photographed_board_is_told_in_degrees(tmp_path):
    for name, height in (("low.png", 0.0), ("high.png", 0.1)):
        cv2.imwrite(str(tmp_path / name), board(height, np.radians(3)))
    heights = ("low.png", "high.png", *BOARD, "--window", "auto", "--heights", "0cm,10cm")
    done = calibrate(*heights, "--two-planes", "planes.yaml", folder=tmp_path)
    assert done.returncode == 0
    told = re.search(r"tilted against the image by ([0-9.]+) deg.*--projective", done.stderr)
    assert float(told[1]) == pytest.approx(3, abs=0.5)


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
