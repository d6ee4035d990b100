"""Pictures from a folder: order, time, ends, and files that are not what they say."""

from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.engine.engine import Engine
from quadvis.testing import Driven, drive
from quadvis_blocks.vision.image_folder import ImageFolder


def picture(number: int) -> np.ndarray:
    """Return a small picture that says its number and tells blue from red."""
    pixels = np.zeros((6, 8, 3), np.uint8)
    pixels[..., 0], pixels[..., 2] = number, 200
    return pixels


def fill(folder: Path, names: list[str]) -> None:
    """Write numbered pictures, counted from 1."""
    for number, name in enumerate(names, 1):
        assert cv2.imwrite(str(folder / name), picture(number))


def play(folder: Path, steps: int, **parameters: Any) -> Driven:
    """Return what some steps at 10 Hz gave."""
    return drive(ImageFolder(folder=str(folder), **parameters), rate="10 Hz", steps=steps)


def shown(driven: Driven) -> list[int]:
    """Return the numbers in the pictures, 0 for one without pixels."""
    return [int(frame.pixels[0, 0, 0]) if frame.pixels.size else 0 for frame in driven.frame]


def test_pictures_come_in_the_order_of_their_numbers(tmp_path: Path) -> None:
    fill(tmp_path, ["view1.png", "view2.bmp", "view10.png", "view11.png"])
    (tmp_path / "notes.txt").write_text("not a picture")
    driven = play(tmp_path, 4)
    assert shown(driven) == [1, 2, 3, 4]
    assert [frame.sequence for frame in driven.frame] == [1, 2, 3, 4]
    assert [frame.stamp for frame in driven.frame] == pytest.approx(driven.time)
    assert np.array_equal(driven.frame[0].pixels, picture(1))
    assert driven.frame[0].pixels.dtype == np.uint8


def test_the_last_picture_stays_when_the_folder_is_finished(tmp_path: Path) -> None:
    fill(tmp_path, ["a.png", "b.png"])
    driven = play(tmp_path, 5)
    assert shown(driven) == [1, 2, 2, 2, 2]
    assert driven.finished.tolist() == [False, False, True, True, True]
    assert [frame.sequence for frame in driven.frame] == [1, 2, 2, 2, 2]
    assert [frame.stamp for frame in driven.frame] == pytest.approx([0, 0.1, 0.1, 0.1, 0.1])


def test_a_loop_begins_again_and_goes_on_counting(tmp_path: Path) -> None:
    fill(tmp_path, ["a.png", "b.png", "c.png"])
    driven = play(tmp_path, 7, loop=True)
    assert shown(driven) == [1, 2, 3, 1, 2, 3, 1]
    assert [frame.sequence for frame in driven.frame] == [1, 2, 3, 4, 5, 6, 7]
    assert not driven.finished.any()


def test_a_pattern_chooses_files(tmp_path: Path) -> None:
    fill(tmp_path, ["left1.png", "right1.png", "left2.png"])
    assert shown(play(tmp_path, 2, pattern="left*")) == [1, 3]


@pytest.mark.parametrize("name", ["b.png", "b.jpg", "b.bmp"])
@pytest.mark.parametrize("share", [0.0, 0.1, 0.6, 0.97])
def test_a_picture_that_is_cut_short_is_a_frame_without_pixels(
    tmp_path: Path, name: str, share: float
) -> None:
    noise = np.random.default_rng(0).integers(0, 255, (60, 80, 3)).astype(np.uint8)
    fill(tmp_path, ["a.png"])
    cv2.imwrite(str(tmp_path / name), noise)
    cv2.imwrite(str(tmp_path / "c.png"), picture(3))
    data = (tmp_path / name).read_bytes()
    (tmp_path / name).write_bytes(data[: int(len(data) * share)])
    driven = play(tmp_path, 3)
    assert driven.frame[1].pixels.shape == (0, 0, 3)
    assert (driven.frame[1].sequence, driven.frame[1].stamp) == (2, pytest.approx(0.1))
    assert shown(driven) == [1, 0, 3]


@pytest.mark.parametrize("name", ["whole.png", "whole.jpg", "whole.bmp"])
def test_a_whole_picture_with_something_behind_it_is_read(tmp_path: Path, name: str) -> None:
    cv2.imwrite(str(tmp_path / name), np.full((16, 16, 3), 77, np.uint8))
    with (tmp_path / name).open("ab") as file:
        file.write(bytes(20))
    assert play(tmp_path, 1).frame[0].pixels.shape == (16, 16, 3)


def test_a_grey_picture_becomes_three_equal_channels(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "grey.png"), np.full((4, 5), 77, np.uint8))
    assert (play(tmp_path, 1).frame[0].pixels == np.full((4, 5, 3), 77)).all()


def test_a_picture_that_vanishes_during_the_run_does_not_stop_it(tmp_path: Path) -> None:
    fill(tmp_path, ["a.png", "b.png"])
    graph = play(tmp_path, 1).engine.graph
    with Engine(graph) as engine:
        engine.run(1)
        (tmp_path / "b.png").unlink()
        engine.run(1)
        assert engine.read("block", "frame").pixels.shape == (0, 0, 3)


def test_a_restored_run_shows_the_same_pictures(tmp_path: Path) -> None:
    fill(tmp_path, ["a.png", "b.png", "c.png"])
    graph = play(tmp_path, 1).engine.graph

    def run(engine: Engine) -> list[tuple[int, int, float]]:
        seen = []
        for _ in range(4):
            engine.run(1)
            frame = engine.read("block", "frame")
            seen.append((int(frame.pixels[0, 0, 0]), frame.sequence, frame.stamp))
        return seen

    with Engine(graph) as engine:
        engine.run(1)
        snapshot = engine.snapshot()
        first = run(engine)
        engine.restore(snapshot)
        assert run(engine) == first
    assert [number for number, _, _ in first] == [2, 3, 3, 3]


def test_a_missing_or_empty_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ParameterError, match="does not exist; name a folder with pictures"):
        ImageFolder(folder=str(tmp_path / "none"))
    with pytest.raises(
        ParameterError, match=r"matches '\*'; it needs at least one file of bmp, jpeg, jpg, png"
    ):
        ImageFolder(folder=str(tmp_path))
    for pattern in ("", "/tmp/*.png"):
        with pytest.raises(
            ParameterError, match=r"does not name files in the folder; write e\.g\. '\*\.png'"
        ):
            ImageFolder(folder=str(tmp_path), pattern=pattern)
