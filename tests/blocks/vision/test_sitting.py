"""A calibration in one sitting: which views are taken, what is missing, and the camera that comes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import cv2
import numpy as np
import pytest

from quadvis_vision.calibrate.chessboard import Board
from quadvis_vision.calibrate.coverage import FLAT, NEAR, TILTS, Coverage
from quadvis_vision.calibrate.sitting import Answer, Sitting
from quadvis_vision.capture.sharpness import sharpness
from quadvis_vision.trials.photographs import calibrate_photographs

SIZE = (640, 480)
BOARD = Board(7, 5, 0.03)
MATRIX = np.array([[600.0, 0.0, 320.0], [0.0, 600.0, 240.0], [0.0, 0.0, 1.0]])
SQUARE = 40  # px of the board's own picture
FAR, CLOSE = 0.55, 0.33  # m


def paper() -> Any:
    """Return the board as a picture, with a white margin of one square."""
    rows, columns = np.indices((BOARD.rows + 3, BOARD.columns + 3))
    inside = (rows > 0) & (rows < BOARD.rows + 2) & (columns > 0) & (columns < BOARD.columns + 2)
    squares = np.where(inside & ((rows + columns) % 2 == 0), 20, 235).astype(np.uint8)
    return np.kron(squares, np.ones((SQUARE, SQUARE), np.uint8))


def view(x: float, y: float, z: float, about_x: float = 0.0, about_y: float = 0.0) -> Any:
    """Return the grey picture of the board: its middle at x, y, z (m), turned about the axes (deg)."""
    rotation = cv2.Rodrigues(np.radians([about_x, about_y, 0.0]))[0]
    middle = BOARD.points.mean(axis=0)
    # From pixels of the paper to the board's plane (m), the first corner at its origin.
    scale = BOARD.square / SQUARE
    place = np.array([[scale, 0, -2 * BOARD.square], [0, scale, -2 * BOARD.square], [0, 0, 1.0]])
    shift = np.array([x, y, z]) - rotation[:, :2] @ middle
    homography = MATRIX @ np.column_stack([rotation[:, 0], rotation[:, 1], shift]) @ place
    seen = cv2.warpPerspective(paper(), homography, SIZE, borderValue=128, flags=cv2.INTER_AREA)
    return cv2.GaussianBlur(seen, (0, 0), 0.7)


def corners(picture: Any) -> Any:
    from quadvis_vision.calibrate.chessboard import find_corners

    found = find_corners(picture, BOARD, None)
    assert found is not None
    return found.pixels


@pytest.mark.parametrize(
    ("turned", "how"),
    [((0, 0), FLAT), ((0, 30), TILTS[0]), ((0, -30), TILTS[1]), ((-30, 0), TILTS[2]), ((30, 0), TILTS[3])],
)
def test_a_tilt_is_named_by_the_side_that_is_away(turned: tuple[float, float], how: str) -> None:
    """Turned about y by a positive angle, the right side of a board comes near: z = -x sin(angle)."""
    shown = Coverage(BOARD, SIZE).shows(corners(view(0, 0, 0.45, *turned)))
    assert how in shown and "middle" in shown


def test_what_is_missing_is_said_in_words() -> None:
    coverage = Coverage(BOARD, SIZE)
    assert coverage.words().startswith("the board was nowhere upper left, upper, upper right, left, middle,")
    coverage.add(corners(view(0, 0, FAR)))
    regions, ways = coverage.missing
    assert "middle" not in regions and ways == [*TILTS, NEAR]
    assert NEAR in coverage.shows(corners(view(0, 0, 0.26)))
    assert coverage.shows(corners(view(-0.15, -0.1, FAR))) >= {"upper left", FLAT}
    assert "lower right" in coverage.missing[0]


def places() -> Iterator[Any]:
    """Yield views as somebody shows them: all over the picture, tilted all ways, near and far."""
    for x in (-0.16, 0.0, 0.16):
        for y in (-0.11, 0.0, 0.11):
            yield view(x, y, FAR, 15 * np.sign(y), -15 * np.sign(x))
    for turned in ((0, 0), (0, 35), (0, -35), (35, 0), (-35, 0)):
        yield view(0.01 * turned[0] / 35, 0.0, CLOSE + 0.05, *turned)
    yield view(0, 0, 0.26)


def test_a_sitting_takes_what_is_still_and_sharp_and_new_and_gives_the_camera() -> None:
    sitting = Sitting(BOARD, SIZE)
    blank = np.full(SIZE[::-1], 200, np.uint8)
    assert sitting.show(blank, 0.0) is Answer.NO_BOARD
    for number, picture in enumerate(places()):
        sharp = sharpness(picture)
        assert sitting.show(picture, sharp) is Answer.MOVES, number
        taken = sitting.count
        if sitting.show(picture, sharp) is Answer.TAKEN:
            assert sitting.show(picture, sharp) is Answer.KNOWN
            assert sitting.count == taken + 1
    still = view(0.1, 0.05, 0.5, 25, 25)
    sitting.show(still, 1e9)
    assert sitting.show(still, 1e-3) is Answer.BLURRED
    assert sitting.count >= 10 and sitting.coverage.words() == "" and sitting.is_complete
    report, found = calibrate_photographs(BOARD, sitting.views())
    focal = found.camera.matrix[[0, 1], [0, 1]]
    assert np.abs(focal - 600).max() < 6 and np.abs(found.camera.matrix[:2, 2] - [320, 240]).max() < 6
    assert report.deviations["fx"] < 6
