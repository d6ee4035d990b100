"""`quadvis camera`: what it prints of a camera, and a calibration from a video of a board."""

from __future__ import annotations

from pathlib import Path

import cv2
import pytest

from quadvis.cli import main
from quadvis_vision.camera.calibration import CameraCalibration
from tests.blocks.vision.test_sitting import BOARD, SIZE, places
from tests.camera_server import CameraServer, shown


def test_cameras_are_listed(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadvis_vision.capture.devices.cameras", lambda: [])
    assert main(["camera"]) == 0
    assert capsys.readouterr().out == (
        "this computer has no camera; plug one in, or name a URL or a video file instead\n"
    )


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["/dev/none"], "camera '/dev/none' is missing; plug it in, or give the path of another one"),
        (["/dev/none", "--calibrate", "9x6"], "--calibrate needs --square; add such as --square 25mm"),
    ],
)
def test_wrong_calls_are_refused_in_a_sentence(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["camera", *arguments]) == 2
    assert words in capsys.readouterr().err


@pytest.mark.slow
def test_pictures_of_a_camera_are_written_and_its_rate_is_measured(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with CameraServer() as server:
        assert main(["camera", server.url, "-o", str(tmp_path / "seen"), "--count", "3"]) == 0
    out = capsys.readouterr().out
    files = sorted((tmp_path / "seen").glob("*.png"))
    numbers = [shown(cv2.imread(str(file))) for file in files]
    assert len(numbers) == 3 and numbers == sorted(numbers) and min(numbers) >= 0
    for words in ("96 x 64 px, ", "pictures a second, measured over 1", "stamped by the read", "sharpness: "):
        assert words in out


@pytest.mark.slow
def test_a_size_that_the_camera_does_not_have_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    with CameraServer() as server:
        assert main(["camera", server.url, "--size", "640x480"]) == 2
    assert "pictures are 96 x 64 px, not 640 x 480 px; " in capsys.readouterr().err


@pytest.mark.slow
def test_a_video_of_a_board_calibrates_its_camera(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    video, output = tmp_path / "board.avi", tmp_path / "camera.yaml"
    writer = cv2.VideoWriter(str(video), cv2.VideoWriter.fourcc(*"FFV1"), 6.0, SIZE)
    for picture in places():
        for _ in range(6):
            writer.write(cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR))
    writer.release()
    board = f"{BOARD.columns}x{BOARD.rows}"
    command = ["camera", str(video), "--calibrate", board, "--square", "3cm", "-o", str(output)]
    assert main([*command, "--idle", "15"]) == 0
    captured = capsys.readouterr()
    assert "standard deviation" in captured.out and "all places and tilts are there" in captured.err
    matrix = CameraCalibration.load(str(output)).matrix
    assert abs(matrix[0, 0] - 600) < 6 and abs(matrix[1, 1] - 600) < 6
