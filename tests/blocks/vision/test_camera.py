"""The block of a camera: what a step gives of the pictures that have come, and its replay."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.block import ParameterError, SourceRecord
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.capture import GOOD, OPENING
from quadvis.machine.ports import PortError
from quadvis.output.log_reader import read_log
from quadvis.testing import drive
from quadvis_blocks.vision.camera import Camera
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.capture.pixels import packed
from tests.camera_server import SIZE, CameraServer, painted, shown

CALM = quadvis.RealTime(priority=0, poll="0 s")
DIAGRAM = """
quadvis: 1
name: watching
rates: {{vision: 20 Hz}}
stop_time: 2 s
overload: {{action: warn}}
blocks:
  eyes:
    block: vision.camera
    rate: vision
    with: {{device: "{}", calibration: camera.yaml}}
  detector:
    block: vision.circle_detector
    rate: vision
    with: {{colours: {}, calibration: camera.yaml}}
    in: {{frame: eyes.frame}}
"""


class FakeSource:
    """Records by stamp, of which the run has those that are not ahead."""

    status, refused, text = GOOD, 0, "a fake"

    def __init__(self, *records: tuple[float, int]) -> None:
        self._records = records

    def newest(self, time: float, after: float) -> SourceRecord | None:
        found = [record for record in self._records if after < record[0] < time]
        if not found:
            return None
        stamp, number = found[-1]
        return SourceRecord(stamp, number, memoryview(b"".join(packed(painted(number)))))


def steps(source: FakeSource, count: int) -> list[dict[str, Any]]:
    """Return the outputs of so many steps at 10 Hz."""
    graph = drive(Camera(device="/dev/video0"), rate="10 Hz", steps=1).engine.graph
    found = []
    engine = Engine(graph)
    engine.bound("block").source = source
    with engine:
        for _ in range(count):
            engine.run(1)
            found.append({name: engine.read("block", name) for name in Camera.interface.outputs})
    return found


def test_a_step_gives_the_newest_picture_that_is_not_ahead_of_it() -> None:
    rows = steps(FakeSource((-0.1, 4), (0.05, 5), (0.16, 6), (0.17, 7), (0.3, 9)), 5)
    assert [row["frame"].sequence for row in rows] == [0, 1, 3, 3, 5]
    assert [shown(row["frame"].pixels) for row in rows[1:]] == [5, 7, 7, 9]
    assert [row["fresh"] for row in rows] == [False, True, True, False, True]
    assert [row["lost"] for row in rows] == [0, 0, 1, 1, 2]
    assert [row["frame"].stamp for row in rows[1:]] == [row["stamp"] for row in rows[1:]]
    assert math.isnan(rows[0]["age"])
    assert [row["age"] for row in rows[1:]] == pytest.approx([0.05, 0.03, 0.13, 0.1])


def test_a_camera_that_is_not_back_at_the_end_is_an_error() -> None:
    source = FakeSource((0.05, 1))
    source.status, source.text = OPENING, "'/dev/video0' is missing"  # type: ignore[misc]
    with pytest.raises(RunError, match="'/dev/video0' is missing") as caught:
        steps(source, 3)
    assert caught.value.block == "block" or isinstance(caught.value.__cause__, PortError)


def test_wrong_parameters_are_refused(tmp_path: Path) -> None:
    calibration = calibrated(tmp_path)
    with pytest.raises(ParameterError, match="size is 640 x 480 px, and the calibration is for 96 x 64 px"):
        Camera(device="0", calibration=calibration, size=[640, 480])
    with pytest.raises(ParameterError, match="size must have a width and a height"):
        Camera(device="0", size=[640, 0])
    with pytest.raises(ParameterError, match=r"exposure must be at most the period of fps, 0\.02 s"):
        Camera(device="0", fps=50.0, exposure=0.03)
    assert Camera(device="http://a/", calibration=calibration).capture().about.size == SIZE
    assert Camera(device="http://a/", size=[640, 480]).capture().about.size == (640, 480)


def calibrated(folder: Path) -> str:
    """Write the calibration of the camera of the tests; return its path."""
    path = folder / "camera.yaml"
    matrix = np.array([[90.0, 0.0, 48.0], [0.0, 90.0, 32.0], [0.0, 0.0, 1.0]])
    CameraCalibration(SIZE, matrix, np.zeros(5)).save(path)
    return str(path)


def diagram(folder: Path, device: str) -> Path:
    calibrated(folder)
    path = folder / "watching.yaml"
    colours = Path(__file__).parents[3] / "diagrams" / "calib" / "colours.yaml"
    path.write_text(DIAGRAM.format(device, colours))
    return path


def test_no_simulation_reaches_a_camera(tmp_path: Path) -> None:
    with pytest.raises(QuadvisError, match="block 'eyes' reaches port '/dev/video0', and only a real-time"):
        quadvis.load(diagram(tmp_path, "/dev/video0")).run()


def test_a_camera_is_at_no_cable(tmp_path: Path) -> None:
    with pytest.raises(QuadvisError, match="'pty:eyes' is a cable for bytes; write such as /dev/v4l/by-id"):
        quadvis.load(diagram(tmp_path, "pty:eyes"))


@pytest.mark.slow
def test_a_run_sees_a_camera_and_its_log_is_replayed_without_one(tmp_path: Path) -> None:
    log, said = tmp_path / "log.mcap", []
    with CameraServer() as server:
        loaded = quadvis.load(diagram(tmp_path, server.url))
        loaded.run(real_time=CALM, log=log, announce=said.append)
    held = read_log(log)
    assert f"block 'eyes': '{server.url}' by FFMPEG, 25 pictures a second, stamped by the read" in said
    fresh, stamps = held["eyes.fresh"], held["eyes.stamp"]
    assert fresh.sum() >= 5
    assert (np.diff(stamps[fresh]) > 0).all() and (stamps[fresh] >= 0).all()
    assert (held["eyes.age"][fresh] > 0).all()
    assert (held["eyes.refused"] == 0).all() and (held["eyes.status"] == GOOD).all()
    # The detector had each picture as its frame.
    assert (held["detector.fresh"] == fresh).all()
    again = quadvis.replay(log)
    assert again.same and {"eyes", "detector"} <= set(again.played)
