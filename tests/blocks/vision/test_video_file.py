"""Pictures from a video file: order, time, ends, and going back."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.engine.engine import Engine
from quadvis.testing import Driven, drive
from quadvis_blocks.vision.video_file import VideoFile

FRAMES = 30


def write(path: Path, codec: str = "FFV1") -> Path:
    """Write a video of which each frame is as bright as its number says, 7 grey levels a frame."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*codec), 25.0, (64, 48))
    assert writer.isOpened()
    for number in range(FRAMES):
        writer.write(np.full((48, 64, 3), 20 + 7 * number, np.uint8))
    writer.release()
    return path


def play(path: Path, steps: int, **parameters: Any) -> Driven:
    """Return what some steps at 10 Hz gave."""
    return drive(VideoFile(file=str(path), **parameters), rate="10 Hz", steps=steps)


def numbers(frames: list[Any]) -> list[int]:
    """Return the frame numbers that the brightness says."""
    return [round((float(frame.pixels.mean()) - 20) / 7) for frame in frames]


@pytest.mark.parametrize(("name", "codec"), [("a.avi", "FFV1"), ("a.avi", "MJPG"), ("a.mp4", "mp4v")])
def test_frames_come_in_order_one_at_each_tick(tmp_path: Path, name: str, codec: str) -> None:
    driven = play(write(tmp_path / name, codec), FRAMES)
    assert numbers(driven.frame) == list(range(FRAMES))
    assert [frame.sequence for frame in driven.frame] == list(range(1, FRAMES + 1))
    assert [frame.stamp for frame in driven.frame] == pytest.approx(driven.time)
    assert driven.frame[0].pixels.shape == (48, 64, 3)
    assert not driven.finished.any()


def test_the_last_frame_stays_when_the_file_is_finished(tmp_path: Path) -> None:
    driven = play(write(tmp_path / "a.avi"), FRAMES + 3)
    assert numbers(driven.frame[-4:]) == [FRAMES - 1] * 4
    assert [frame.sequence for frame in driven.frame[-4:]] == [FRAMES] * 4
    assert [frame.stamp for frame in driven.frame[-4:]] == pytest.approx([(FRAMES - 1) / 10] * 4)
    assert driven.finished.tolist() == [False] * FRAMES + [True] * 3


def test_a_loop_begins_again_and_goes_on_counting(tmp_path: Path) -> None:
    driven = play(write(tmp_path / "a.avi"), 2 * FRAMES + 5, loop=True)
    assert numbers(driven.frame) == [tick % FRAMES for tick in range(2 * FRAMES + 5)]
    assert driven.frame[-1].sequence == 2 * FRAMES + 5
    assert not driven.finished.any()


@pytest.mark.parametrize("loop", [False, True])
def test_a_restored_run_shows_the_same_frames(tmp_path: Path, loop: bool) -> None:
    graph = play(write(tmp_path / "a.mp4", "mp4v"), 1, loop=loop).engine.graph

    def run(engine: Engine) -> list[Any]:
        frames = []
        for _ in range(10):
            engine.run(1)
            frames.append(engine.read("block", "frame"))
        return frames

    for before in (4, FRAMES - 5, FRAMES + 2):
        with Engine(graph) as engine:
            engine.run(before)
            snapshot = engine.snapshot()
            runs = [run(engine)]
            engine.restore(snapshot)
            runs.append(run(engine))
        with Engine(graph) as engine:  # a new process knows nothing of the file yet
            engine.restore(snapshot)
            runs.append(run(engine))
        for one, two, three in zip(*runs, strict=True):
            assert (one.sequence, one.stamp) == (two.sequence, two.stamp) == (three.sequence, three.stamp)
            assert np.array_equal(one.pixels, two.pixels) and np.array_equal(one.pixels, three.pixels)


def test_a_file_that_is_cut_short_ends_early(tmp_path: Path) -> None:
    path = write(tmp_path / "a.avi", "MJPG")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) * 3 // 4])
    driven = play(path, FRAMES + 1)
    assert driven.finished[-1]
    last = driven.frame[-1].sequence
    assert 5 < last < FRAMES
    assert numbers(driven.frame)[: last - 1] == list(range(last - 1))  # the last one may be half a picture


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="does not exist; name a video file"):
        VideoFile(file=str(tmp_path / "none.avi"))


def test_a_file_that_is_no_video_is_refused_when_it_is_opened(tmp_path: Path) -> None:
    path = tmp_path / "a.avi"
    path.write_text("no video")
    with pytest.raises(ParameterError, match="is not a video that OpenCV can read"):
        play(path, 1)
