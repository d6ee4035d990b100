from __future__ import annotations

import datetime
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from quadvis_vision.detection.colours import ColourCalibration
from quadvis_vision.trials.scenes import CONDITIONS, shoot

from .script import run_script

ROOT = Path(__file__).parents[2]
DIAGRAM = ROOT / "diagrams" / "recorded.yaml"
FRAMES = [
    ROOT / "diagrams" / "recordings" / "hand_held" / f"0000{number}.jpg" for number in ("01", "12", "28")
]
VIDEO = ROOT / "diagrams" / "recordings" / "hand_held.mp4"


def run(program, *arguments, folder, options=(), stdout=subprocess.PIPE):
    video = any(str(argument).endswith(".mp4") for argument in arguments)  # whose reader prints by itself
    if isinstance(program, Path) and not options and not video and stdout == subprocess.PIPE:
        return run_script(program, *arguments, folder=folder)
    arguments = (program, *arguments)
    paths = [str(ROOT), str(ROOT / "blocks"), *filter(None, [os.environ.get("PYTHONPATH")])]
    return subprocess.run(
        [sys.executable, *options, *map(str, arguments)],
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
        timeout=120,
    )


def calibrate(*arguments, folder, **more):
    return run(ROOT / "tools" / "calibrate_colours", *arguments, folder=folder, **more)


def refused(*arguments, folder):
    """Return the one sentence with which the program ends; nothing may be written."""
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    done = calibrate(*arguments, folder=folder)
    assert done.returncode == 2 and not done.stdout
    assert "Traceback" not in done.stderr and len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before
    return done.stderr


@pytest.fixture(scope="module")
def scenes(tmp_path_factory):
    """A folder of pictures, named after what they show."""
    folder = tmp_path_factory.mktemp("scenes")
    rng = np.random.default_rng(1)
    for name in ("clean", "warm", "light x0.3", "12 decoys", "1 missing", "empty"):
        cv2.imwrite(str(folder / f"{name}.png"), shoot(rng, (320, 240), CONDITIONS[name]).pixels)
    clean = cv2.imread(str(folder / "clean.png"))
    cv2.imwrite(str(folder / "mirrored.png"), clean[:, ::-1])
    cv2.imwrite(str(folder / "grey.png"), cv2.cvtColor(clean, cv2.COLOR_BGR2GRAY))
    (folder / "note.png").write_text("this is not a picture\n")
    (folder / "note.mp4").write_text("this is not a video\n")
    (folder / "cut.png").write_bytes((folder / "clean.png").read_bytes()[:20000])
    (folder / "a folder").mkdir()
    return folder


def test_help_loads_nothing_heavy(tmp_path):
    done = calibrate("--help", folder=tmp_path, options=["-X", "importtime"])
    assert done.returncode == 0
    assert "examples:" in done.stdout and "--order" in done.stdout
    loaded = {line.rsplit("|", 1)[-1].strip().split(".")[0] for line in done.stderr.splitlines()}
    assert "argparse" in loaded
    assert not loaded & {"cv2", "numpy", "yaml", "quadvis_blocks", "quadvis_vision"}


def test_the_program_can_be_started_by_its_name():
    assert os.access(ROOT / "tools" / "calibrate_colours", os.X_OK)
    assert (ROOT / "tools" / "calibrate_colours").read_text().startswith("#!/usr/bin/env python3\n")


def test_three_frames_of_the_recording_give_colours_with_which_all_of_it_is_seen(tmp_path):
    done = calibrate(*FRAMES, folder=tmp_path)
    assert done.returncode == 0 and not done.stderr
    for word in ("red", "blue", "green", "black", *(frame.name for frame in FRAMES), "4 of 4"):
        assert word in done.stdout
    assert "runs/colours.yaml" in done.stdout and "runs/colours.png" in done.stdout
    played = run(
        "-m", "quadvis", "run", DIAGRAM, "--set", "detector.colours=runs/colours.yaml", "--log",
        "recorded.mcap", folder=tmp_path,
    )  # fmt: skip
    assert played.returncode == 0, played.stderr
    assert re.search(r"four circles +count 30\n", played.stdout)


def test_the_file_says_how_it_was_made(scenes, tmp_path):
    names = ("clean.png", "warm.png", "12 decoys.png")
    done = calibrate(*(scenes / name for name in names), "-o", "my.yaml", folder=tmp_path)
    assert done.returncode == 0
    colours = ColourCalibration.load(tmp_path / "my.yaml")
    assert datetime.date.fromisoformat(colours.evidence.date) <= datetime.date.today()
    assert colours.evidence.samples.shape == (3, 4, 3) and len(colours.evidence.errors) == 3
    assert 0 < colours.evidence.rms < 0.1
    head = (tmp_path / "my.yaml").read_text().splitlines()[0]
    assert head.startswith("#") and "3 pictures" in head and all(name in head for name in names)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["my.png", "my.yaml"]


def test_a_number_that_is_changed_in_the_file_is_told_with_its_place(scenes, tmp_path):
    calibrate(scenes / "clean.png", "-o", "my.yaml", folder=tmp_path)
    text = (tmp_path / "my.yaml").read_text()
    line = next(line for line in text.splitlines() if "green" in line and "colour:" in line)
    (tmp_path / "my.yaml").write_text(text.replace(line, line.replace("ratio: [0.", "ratio: [0.1")))
    done = run("-m", "quadvis", "run", DIAGRAM, "--set", "detector.colours=my.yaml", folder=tmp_path)
    assert done.returncode == 2 and "calibrate again" in done.stderr and "my.yaml:" in done.stderr


def test_json_holds_everything(scenes, tmp_path):
    done = calibrate(scenes / "clean.png", scenes / "light x0.3.png", "--json", folder=tmp_path)
    found = json.loads(done.stdout)
    stored = ColourCalibration.load(tmp_path / "runs" / "colours.yaml")
    assert [circle["ratio"] for circle in found["circles"]] == stored.prototypes.tolist()
    assert [picture["name"] for picture in found["pictures"]] == ["clean.png", "light x0.3.png"]
    assert [picture["found_again"] for picture in found["pictures"]] == [4, 4]
    assert np.shape([picture["centres"] for picture in found["pictures"]]) == (2, 4, 2)


def test_the_drawing_shows_each_circle_with_a_line_around_it(scenes, tmp_path):
    done = calibrate(scenes / "clean.png", "--json", "--overlay", "drawn.png", folder=tmp_path)
    assert done.returncode == 0
    drawn, picture = cv2.imread(str(tmp_path / "drawn.png")), cv2.imread(str(scenes / "clean.png"))
    zoom = drawn.shape[1] / picture.shape[1]
    assert zoom == 2 and drawn.shape[0] > zoom * picture.shape[0] + 100
    (seen,) = json.loads(done.stdout)["pictures"]
    for (u, v), radius in zip(seen["centres"], seen["radii"], strict=True):
        x, y = round(zoom * (u + 0.5)), round(zoom * (v + 0.5))
        # The paint stays as it is; on the rim there is the light line, from every side.
        assert np.abs(drawn[y, x].astype(int) - picture[round(v), round(u)]).max() < 60
        for way in np.linspace(0, 2 * np.pi, 12, endpoint=False):
            along = zoom * radius + np.arange(-3, 4)
            line = drawn[
                np.rint(y + along * np.sin(way)).astype(int), np.rint(x + along * np.cos(way)).astype(int)
            ]
            assert line.min(axis=1).max() > 90 and line.max(axis=1).min() < 60


@pytest.mark.parametrize("count", [1, 2, 4, 5])
def test_pictures_of_any_number_and_size_are_drawn(scenes, tmp_path, count):
    names = ["clean.png", "warm.png", "12 decoys.png", "light x0.3.png"]
    large = shoot(np.random.default_rng(2), (640, 400)).pixels
    cv2.imwrite(str(tmp_path / "large.png"), large)
    frames = ["large.png", *(scenes / name for name in names)][:count]
    done = calibrate(*frames, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    columns = {1: 1, 2: 2, 4: 2, 5: 3}[count]
    assert cv2.imread(str(tmp_path / "runs" / "colours.png")).shape[1] == columns * 640


def test_five_frames_of_a_video_are_enough(tmp_path):
    done = calibrate(VIDEO, folder=tmp_path)
    assert done.returncode == 0 and not done.stderr
    for number in (1, 8, 16, 23, 30):
        assert f"hand_held.mp4 frame {number} " in done.stdout


def test_a_file_that_is_there_is_replaced_as_a_whole(scenes, tmp_path):
    (tmp_path / "there.yaml").write_text("circles: old")
    (tmp_path / "my.yaml").symlink_to("there.yaml")
    assert calibrate(scenes / "clean.png", "-o", "my.yaml", folder=tmp_path).returncode == 0
    assert (tmp_path / "my.yaml").is_symlink()
    ColourCalibration.load(tmp_path / "there.yaml")
    umask = os.umask(0)
    os.umask(umask)
    assert (tmp_path / "there.yaml").stat().st_mode & 0o777 == 0o666 & ~umask


def test_names_that_a_yaml_file_cannot_hold_do_no_harm(scenes, tmp_path):
    name = "b\u202ead\nname\x07: [.png"
    shutil.copy(scenes / "clean.png", tmp_path / name)
    assert calibrate(name, folder=tmp_path).returncode == 0
    ColourCalibration.load(tmp_path / "runs" / "colours.yaml")


def test_orientation_tags_and_bytes_behind_the_end_are_ignored(tmp_path):
    plain, changed = tmp_path / "plain", tmp_path / "changed"
    for folder in (plain, changed):
        folder.mkdir()
        shutil.copy(FRAMES[0], folder / "frame.jpg")
    data = (changed / "frame.jpg").read_bytes()
    asks = b"Exif\0\0MM\0*\0\0\0\x08\0\1\1\x12\0\3\0\0\0\1\0\6\0\0\0\0\0\0"
    turned = data[:2] + b"\xff\xe1" + (2 + len(asks)).to_bytes(2, "big") + asks + data[2:]
    (changed / "frame.jpg").write_bytes(turned + bytes(512))
    done = {folder: calibrate("frame.jpg", folder=folder) for folder in (plain, changed)}
    assert done[plain].stdout == done[changed].stdout and not done[plain].stderr
    assert "frame.jpg asks to be turned" in done[changed].stderr
    assert len({(folder / "runs" / "colours.yaml").read_text() for folder in done}) == 1


def test_a_reader_that_stops_early_sees_no_traceback(scenes, tmp_path):
    reading, writing = os.pipe()
    os.close(reading)
    with os.fdopen(writing, "w") as closed:
        done = calibrate(scenes / "clean.png", folder=tmp_path, stdout=closed)
    assert done.returncode == 0 and not done.stderr


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "no pictures; give one to 5"),
        (["clean.png", "--sied", "1m"], "there is no option '--sied'; did you mean '--side'?"),
        (["clean.png"] * 6, "6 pictures; give one to 5"),
        (["empty.png"], "empty.png: no circle"),
        (["clean.png", "1 missing.png"], "1 missing.png: 3 circles"),
        (["mirrored.png"], "clockwise red, black, green, blue"),
        (["grey.png"], "grey.png: the picture has no colours"),
        (["absent.png"], "cannot read 'absent.png'"),
        (["a folder"], "cannot read 'a folder'"),
        (["note.png"], "note.png is not a picture"),
        (["cut.png"], "cut.png is cut short"),
        (["note.mp4"], "not a video"),
        (["note.mp4", "clean.png"], "give it alone"),
        (["clean.png", "--order", "red,blue,green"], "four different colours"),
        (["clean.png", "--order", "red,blue,green,blak"], "did you mean 'black'"),
        (["clean.png", "--order", "blue,red,green,black"], "if the picture is not mirrored"),
        (["clean.png", "--radius", "60cm"], "half of the side"),
        (["clean.png", "--radius", "12"], "12"),
        (["clean.png", "--side", "0m"], "above 0"),
        (["clean.png", "-o", "absent/my.yaml"], "cannot write the colours 'absent/my.yaml'"),
        (["clean.png", "-o", "a folder"], "it is a folder"),
        (["clean.png", "-o", "."], "not a file"),
        (["clean.png", "-o", "clean.yaml"], "'clean.png': it is an input and would be lost"),
        (["clean.png", "-o", "a folder/../clean.png", "--overlay", "x.png"], "would be lost"),
        (["clean.png", "-o", "my.yaml", "--overlay", "clean.png"], "would be lost"),
        (["clean.png", "-o", "note.png", "--overlay", "x.png"], "a file of another kind is there"),
        (["clean.png", "-o", "my.yaml", "--overlay", "note.png"], "a file of another kind is there"),
        (["clean.png", "-o", "my.png"], "both"),
        (["clean.png", "--overlay", "absent/my.png"], "cannot write the picture 'absent/my.png'"),
    ],
)  # fmt: skip
def test_bad_input_ends_with_one_sentence_and_writes_nothing(scenes, arguments, said):
    assert said in refused(*arguments, folder=scenes)


def test_an_order_may_be_written_with_spaces_and_capitals(scenes, tmp_path):
    done = calibrate(scenes / "clean.png", "--order", "Red, Blue, Green, Black", folder=tmp_path)
    assert done.returncode == 0, done.stderr
