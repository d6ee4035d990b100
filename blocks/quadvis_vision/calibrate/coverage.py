"""Which places and tilts of a board the views of a calibration have, and in words which ones are missing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from quadvis_vision.calibrate.chessboard import Board

    Floats = NDArray[np.float64]

REGIONS = (
    ("upper left", "upper", "upper right"),
    ("left", "middle", "right"),
    ("lower left", "lower", "lower right"),
)
FLAT = "parallel to the picture"
TILTS = (
    "left side away from the camera",
    "right side away from the camera",
    "upper side away from the camera",
    "lower side away from the camera",
)
NEAR = "near, so that it fills a quarter of the picture"
TILTED = 1.10  # ratio of opposite edges in the picture: some 20 deg at the distance at which a board is held
FILLED = 0.25  # share of the picture
LEAST = 2  # corners in a region, of those of one view
SAME = 1  # views that show the same as an earlier one, besides it


class Coverage:
    """What the views of a ``board`` show so far, in pictures of ``size`` (width, height; px)."""

    def __init__(self, board: Board, size: tuple[int, int]) -> None:
        self._board, self._size = board, np.array(size, float)
        self._seen: dict[str, int] = {}

    def shows(self, corners: Floats) -> frozenset[str]:
        """Return the regions, the tilt and the nearness of a view, from the corners (n, 2) of the board."""
        outline = _outline(corners, self._board)
        found = {self._region(corner) for corner in corners}
        counts = [self._region(corner) for corner in corners]
        found = {region for region in found if counts.count(region) >= LEAST}
        found |= {_tilt(outline)}
        if _area(outline) / self._size.prod() >= FILLED:
            found.add(NEAR)
        return frozenset(found)

    def is_new(self, corners: Floats) -> bool:
        """Return whether a view shows something that others lack, or only one of them has."""
        return any(self._seen.get(what, 0) <= SAME for what in self.shows(corners) - {NEAR})

    def add(self, corners: Floats) -> None:
        """Count a view."""
        for what in self.shows(corners):
            self._seen[what] = self._seen.get(what, 0) + 1

    @property
    def missing(self) -> tuple[list[str], list[str]]:
        """The regions that no board has reached, and how no board was held."""
        regions = [region for row in REGIONS for region in row if region not in self._seen]
        return regions, [how for how in (*TILTS, FLAT, NEAR) if how not in self._seen]

    def words(self) -> str:
        """Return in words what is missing; "" if nothing is."""
        regions, ways = self.missing
        found = [f"nowhere {', '.join(regions)}"] if regions else []
        found += [f"never {', '.join(ways)}"] if ways else []
        return "the board was " + "; ".join(found) if found else ""

    def _region(self, corner: Floats) -> str:
        column, row = np.clip(corner / self._size * 3, 0, 2).astype(int)
        return REGIONS[row][column]


def _outline(corners: Floats, board: Board) -> Floats:
    """Return the outer corners (4, 2) of a board, clockwise in the picture from the upper left."""
    grid = corners.reshape(board.rows, board.columns, 2)
    outer = np.array([grid[0, 0], grid[0, -1], grid[-1, -1], grid[-1, 0]])
    away = outer - outer.mean(axis=0)
    around = outer[np.argsort(np.arctan2(away[:, 1], away[:, 0]))]  # clockwise in the picture
    first = int(np.argmin(around.sum(axis=1)))
    return np.roll(around, -first, axis=0)


def _tilt(outline: Floats) -> str:
    """Return how a board was held: the side that is shorter than the opposite one is farther away."""
    upper, right, lower, left = np.linalg.norm(np.roll(outline, -1, axis=0) - outline, axis=1)
    across, down = right / left, lower / upper
    ratios = {TILTS[0]: across, TILTS[1]: 1 / across, TILTS[2]: down, TILTS[3]: 1 / down}
    most = max(ratios, key=lambda tilt: ratios[tilt])
    return most if ratios[most] >= TILTED else FLAT


def _area(outline: Floats) -> float:
    x, y = outline.T
    return float(abs(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2)
