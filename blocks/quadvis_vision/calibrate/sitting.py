"""A calibration in one sitting: views are taken from a camera while somebody moves the board before it."""

from __future__ import annotations

from enum import Enum
from typing import TYPE_CHECKING

import numpy as np

from quadvis_vision.calibrate.chessboard import Board, Corners, Views, find_corners
from quadvis_vision.calibrate.coverage import Coverage

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Picture = NDArray[np.uint8]

STILL = 0.02  # of the board's size in the picture: a board that moves more between two pictures is not still
ELSEWHERE = 0.1  # of the board's size: a view that differs less from an earlier one adds little
SHARP = 0.5  # share of the median sharpness of the views so far
FEWEST = 10  # views


class Answer(Enum):
    """What became of a picture."""

    TAKEN = "taken"
    NO_BOARD = "no whole board in view"
    MOVES = "hold the board still"
    BLURRED = "not sharp"
    KNOWN = "such a view is there; show another one"


class Sitting:
    """The views so far, of a ``board`` in pictures of ``size`` (width, height; px)."""

    def __init__(self, board: Board, size: tuple[int, int]) -> None:
        self._board, self._size = board, size
        self.coverage = Coverage(board, size)
        self._views: list[Corners] = []
        self._sharpness: list[float] = []
        self._before: NDArray[np.float64] | None = None
        self._picture: Picture | None = None

    def show(self, picture: Picture, sharpness: float) -> Answer:
        """Take a picture (height, width; grey) if it is a new view of a board that is held still."""
        found = find_corners(picture, self._board, None)
        before, self._before = self._before, found.pixels if found is not None else None
        if found is None:
            return Answer.NO_BOARD
        if before is None or _moved(found.pixels, before) > STILL:
            return Answer.MOVES
        if self._sharpness and sharpness < SHARP * float(np.median(self._sharpness)):
            return Answer.BLURRED
        if not (self.coverage.is_new(found.pixels) and self._is_elsewhere(found.pixels)):
            return Answer.KNOWN
        self.coverage.add(found.pixels)
        self._views.append(found)
        self._sharpness.append(sharpness)
        self._picture = picture
        return Answer.TAKEN

    def _is_elsewhere(self, corners: NDArray[np.float64]) -> bool:
        """Return whether the board was moved since each of the views so far."""
        return all(_moved(corners, view.pixels) > ELSEWHERE for view in self._views)

    @property
    def count(self) -> int:
        """How many views there are."""
        return len(self._views)

    @property
    def is_complete(self) -> bool:
        """True if nothing is missing."""
        return self.count >= FEWEST and not self.coverage.words()

    def views(self) -> Views:
        """Return the views for a calibration."""
        assert self._picture is not None
        names = [f"view {number}" for number in range(1, self.count + 1)]
        return Views(
            names=names,
            corners=[view.pixels for view in self._views],
            size=self._size,
            missed=[],
            crowded=[name for name, view in zip(names, self._views, strict=True) if view.crowded],
            notes=[],
            picture=self._picture,
        )


def _moved(corners: NDArray[np.float64], before: NDArray[np.float64]) -> float:
    """Return the largest movement of a corner, as a share of the board's size in the picture."""
    size = float(np.linalg.norm(np.ptp(corners, axis=0)))
    return float(np.linalg.norm(corners - before, axis=1).max()) / size
