"""No frame ends a run: every block that takes frames ignores a frame that is not a picture.

A new block with a frame input is covered without being named here.
"""

import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from quadvis.block import Block, Frame
from quadvis.library.catalogue import Catalogue
from quadvis.testing import drive
from tests.stages import mostly_slow

ROOT = Path(__file__).parents[2]
CALIB = ROOT / "diagrams" / "calib"
GOOD = cv2.imread(str(ROOT / "diagrams" / "recordings" / "hand_held" / "000001.jpg"))
HIGH, WIDE = GOOD.shape[:2]


def read_only() -> np.ndarray:
    pixels = GOOD.copy()
    pixels.flags.writeable = False
    return pixels


NOT_PICTURES: dict[str, Any] = {
    "no pixels": np.zeros((0, 0, 3), np.uint8),
    "no rows": np.zeros((0, WIDE, 3), np.uint8),
    "no columns": np.zeros((HIGH, 0, 3), np.uint8),
    "no channels": np.zeros((HIGH, WIDE, 0), np.uint8),
    "float": GOOD.astype(np.float64),
    "float from 0 to 1": (GOOD / 255).astype(np.float32),
    "NaN": np.full(GOOD.shape, math.nan),
    "infinity": np.full(GOOD.shape, math.inf, np.float32),
    "bool": GOOD > 128,
    "int64": GOOD.astype(np.int64),
    "int8": GOOD.astype(np.int8),
    "uint16": GOOD.astype(np.uint16) * 257,
    "complex": GOOD.astype(np.complex128),
    "objects": GOOD[:4, :4].astype(object),
    "big endian": GOOD.astype(">u2"),
    "grey": GOOD[..., 0],
    "one channel": GOOD[..., :1],
    "two channels": GOOD[..., :2],
    "four channels": np.dstack((GOOD, GOOD[..., 0])),
    "channels first": GOOD.transpose(2, 0, 1),
    "a batch": GOOD[None],
    "a row": GOOD.ravel(),
    "a number": np.uint8(7),
    "a scalar array": np.array(7, np.uint8),
    "a list": GOOD[:2, :2].tolist(),
    "bytes": GOOD.tobytes(),
    "text": "a picture",
    "nothing": None,
}
PICTURES: dict[str, Any] = {
    "1x1": GOOD[:1, :1].copy(),
    "2x2": GOOD[:2, :2].copy(),
    "3x3": GOOD[:3, :3].copy(),
    "a pixel high": GOOD[:1].copy(),
    "a pixel wide": GOOD[:, :1].copy(),
    "15x15": GOOD[:15, :15].copy(),
    "16x16": GOOD[:16, :16].copy(),
    "an odd size": GOOD[:101, :57].copy(),
    "transposed": GOOD.transpose(1, 0, 2),
    "upside down": GOOD[::-1],
    "mirrored": GOOD[:, ::-1],
    "red and blue swapped": GOOD[..., ::-1],
    "every second pixel": GOOD[::2, ::2],
    "one pixel many times": np.broadcast_to(GOOD[:1, :1], GOOD.shape),
    "read-only": read_only(),
    "black": np.zeros_like(GOOD),
    "white": np.full_like(GOOD, 255),
    "noise": np.random.default_rng(0).integers(0, 256, GOOD.shape, np.uint8),
    "wide": np.zeros((4, 5000, 3), np.uint8),
    "high": np.zeros((5000, 4, 3), np.uint8),
    "a subclass": np.ma.masked_array(GOOD, GOOD > 99),
}
STAMPS = [math.nan, math.inf, -math.inf, -1.0, 1e300, 0.0]
SEQUENCES = [2**31, 2**53 + 1, 2**62, 2**63 - 1, -1, -(2**63)]
TAKERS = [
    name
    for name in Catalogue().names()
    if any(port.type == "frame" for port in Catalogue().find(name).interface.inputs.values())
]


def make(name: str, folder: Path, **parameters: Any) -> Block:
    block = Catalogue().find(name)
    values = {
        "calibration": str(CALIB / "camera.yaml"),
        "colours": str(CALIB / "colours.yaml"),
        "folder": str(folder / "frames"),
        "file": str(folder / "video.avi"),
    }
    given = {key: values[key] for key, param in block.interface.params.items() if param.required}
    return block(**given | parameters)


def feed(block: Block, frames: list[Frame]) -> Any:
    """Give a block these frames, and zeros or the default for all else."""
    inputs: dict[str, Any] = {}
    for name, port in block.interface.inputs.items():
        if port.type == "frame":
            inputs[name] = frames
        elif port.default is None:
            inputs[name] = np.zeros(port.signal.resolve({}), port.signal.scalar)
    return drive(block, rate="10 Hz", steps=len(frames), **inputs)


def between(pixels: Any) -> list[Frame]:
    """Return a frame first, between good ones, twice in a row, and last."""
    shown = [pixels, GOOD, pixels, GOOD, GOOD, pixels, pixels]
    return [Frame(picture, 0.1 * number, number) for number, picture in enumerate(shown, 1)]


def test_there_are_blocks_that_take_frames() -> None:
    assert {"vision.annotator", "vision.circle_detector", "vision.frame_writer"} <= set(TAKERS)


@pytest.mark.parametrize("kind", NOT_PICTURES | PICTURES)
@pytest.mark.parametrize("name", TAKERS)
def test_a_frame_of_any_kind_does_not_end_a_run(name: str, kind: str, tmp_path: Path) -> None:
    feed(make(name, tmp_path), between((NOT_PICTURES | PICTURES)[kind]))


@pytest.mark.parametrize("suffix", mostly_slow(["avi", "mp4", "mkv"], slow=1))
@pytest.mark.parametrize("kind", NOT_PICTURES | PICTURES)
def test_a_frame_of_any_kind_does_not_end_any_video(kind: str, suffix: str, tmp_path: Path) -> None:
    file = tmp_path / f"video.{suffix}"
    feed(make("vision.video_writer", tmp_path, file=str(file)), between((NOT_PICTURES | PICTURES)[kind]))
    video, count = cv2.VideoCapture(str(file)), 0
    while video.grab():
        count += 1
    assert count == 7


@pytest.mark.parametrize("name", TAKERS)
def test_stamps_and_numbers_of_any_kind_do_not_end_a_run(name: str, tmp_path: Path) -> None:
    frames = [Frame(GOOD, stamp, number) for number, stamp in enumerate(STAMPS, 1)]
    frames += [Frame(GOOD, 0.1, number) for number in SEQUENCES]
    frames += [Frame(NOT_PICTURES["float"], math.nan, number) for number in SEQUENCES]
    feed(make(name, tmp_path), frames)


@pytest.mark.parametrize("format", mostly_slow(["png", "jpg"]))
@pytest.mark.parametrize("kind", NOT_PICTURES)
def test_what_is_not_a_picture_is_not_written(kind: str, format: str, tmp_path: Path) -> None:
    feed(make("vision.frame_writer", tmp_path, format=format), between(NOT_PICTURES[kind]))
    written = sorted(file.name for file in (tmp_path / "frames").iterdir())
    assert written == [f"{number:06d}.{format}" for number in (2, 4, 5)]


@pytest.mark.parametrize("kind", PICTURES)
def test_what_is_a_picture_is_written_as_it_is(kind: str, tmp_path: Path) -> None:
    feed(make("vision.frame_writer", tmp_path), between(PICTURES[kind]))
    assert np.array_equal(cv2.imread(str(tmp_path / "frames" / "000001.png")), np.asarray(PICTURES[kind]))


@pytest.mark.parametrize("kind", NOT_PICTURES)
def test_what_is_not_a_picture_is_told_by_the_detector(kind: str, tmp_path: Path) -> None:
    seen = feed(make("vision.circle_detector", tmp_path, repeats="news"), between(NOT_PICTURES[kind]))
    assert seen.status.tolist() == [7, 0, 7, 0, 0, 7, 7]
    assert seen.lost.tolist() == [True, False, True, False, False, True, True]
