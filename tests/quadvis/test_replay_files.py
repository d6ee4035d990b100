"""Replays of runs with files, pictures and cameras: what is read again, and what comes from the log."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

import quadvis
from quadvis import read_log, replay
from quadvis.cli import main
from quadvis.errors import DiagramError, QuadvisError

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def test_files_must_be_what_they_were(tmp_path: Path) -> None:
    hover = tmp_path / "hover"
    (hover / "calib").mkdir(parents=True)
    Path(hover / "own.yaml").write_text(
        "quadvis: 1\nname: own\nbase: {file: quadvis:hover.yaml, variant: geometric}\n"
    )
    text = (ROOT / "diagrams/calib/camera.yaml").read_text()
    camera = hover / "calib/camera.yaml"
    camera.write_text(text)
    settings = {"pose.calibration": str(camera)}
    quadvis.load(hover / "own.yaml", settings=settings, stop_time=0.1).run(log="run.mcap")
    assert replay("run.mcap").same
    camera.write_text(text + "# a note\n")
    with pytest.raises(DiagramError, match=r"calib/camera.yaml' is not what it was: its SHA-256 differs"):
        replay("run.mcap")
    camera.unlink()
    with pytest.raises(
        DiagramError, match=r"run.mcap: diagram:\d+:\d+: there is no file 'calib/camera.yaml'"
    ) as error:
        replay("run.mcap")
    assert error.value.__notes__ == [
        f"the log says that its diagram stood in '{hover}'; folder names another folder"
    ]
    (tmp_path / "moved/calib").mkdir(parents=True)
    (tmp_path / "moved/calib/camera.yaml").write_text(text)
    assert replay("run.mcap", folder="moved").same


def test_recorded_pictures_must_be_what_they_were(tmp_path: Path) -> None:
    shutil.copytree(ROOT / "diagrams/recordings/hand_held", "film/pictures")
    Path("film/film.yaml").write_text(
        """\
quadvis: 1
name: film
rates: {film: 10 Hz}
stop_time: 0.2 s
seed: 1
blocks:
  film: {block: vision.image_folder, rate: film, with: {folder: pictures}}
"""
    )
    quadvis.load("film/film.yaml").run(log="film.mcap")
    names = sorted(f"pictures/{path.name}" for path in Path("film/pictures").iterdir())
    assert sorted(read_log("film.mcap").files) == names
    shutil.copytree("film", "moved")  # with other times of change
    os.utime(f"moved/{names[0]}", (1, 1))
    assert replay("film.mcap", folder="moved").same
    first, second, third = (Path("moved") / name for name in names[:3])
    third.with_stem("x").write_bytes(first.read_bytes())
    first.write_bytes(second.read_bytes())
    second.unlink()
    words = [
        f"file '{names[0]}' is not what it was: its SHA-256 differs",
        f"there is no file '{names[1]}'",
        f"file 'pictures/x{third.suffix}' is new",
    ]
    with pytest.raises(QuadvisError) as caught:
        replay("film.mcap", folder="moved")
    assert str(caught.value) == f"the run cannot be repeated: {'; '.join(words)}"


def test_a_block_that_only_writes_does_not(capsys: pytest.CaptureFixture[str]) -> None:
    pictures = ROOT / "diagrams/recordings/hand_held"
    Path("film.yaml").write_text(
        f"""\
quadvis: 1
name: film
rates: {{film: 10 Hz}}
stop_time: 0.2 s
seed: 1
blocks:
  film: {{block: vision.image_folder, rate: film, with: {{folder: {pictures}}}}}
  pictures: {{block: vision.frame_writer, rate: film, with: {{folder: out}}, in: {{frame: film.frame}}}}
"""
    )
    quadvis.load("film.yaml").run(log="film.mcap")
    for path in Path("out").iterdir():
        path.unlink()
    assert main(["replay", "film.mcap"]) == 0
    assert "  not run, since they only write: pictures" in capsys.readouterr().out.splitlines()
    assert list(Path("out").iterdir()) == []


CAMERA = '''
"""A camera of the world."""

import numpy as np

from quadvis.block import Block, Frame, Out


class Camera(Block, numeric=False):
    """Gives frames that nobody can predict."""

    not_replayable = "it is a camera"

    frame = Out("frame")
    count = Out("int64")

    def open(self):
        self.random, self.number = np.random.default_rng(), 0

    def output(self, time):
        self.number += 1
        pixels = self.random.integers(0, 256, (4, 4, 3), np.uint8)
        return Frame(pixels, time, self.number), self.number
'''
LIGHT = '''
"""How light a frame is."""

from quadvis.block import Block, In, Out


class Light(Block, numeric=False):
    """Gives the mean of all pixels."""

    frame = In("frame")
    y = Out()

    def output(self, frame):
        return float(frame.pixels.mean())
'''


def test_a_block_that_takes_frames_from_outside_counts_as_outside() -> None:
    Path("blocks/own").mkdir(parents=True)
    Path("blocks/own/camera.py").write_text(CAMERA)
    Path("blocks/own/light.py").write_text(LIGHT)
    Path("film.yaml").write_text(
        """\
quadvis: 1
name: film
rates: {film: 10 Hz}
stop_time: 1 s
seed: 1
blocks:
  light: {block: own.light, rate: film, in: {frame: camera.frame}}
  camera: {block: own.camera, rate: film}
  smooth: {block: signal.low_pass, rate: film, in: {u: light.y}}
log: {signals: [smooth]}
"""
    )
    quadvis.load("film.yaml").run(log="film.mcap")
    found = replay("film.mcap")
    assert found.same and set(found.played) == {"camera", "light"}
