"""From photographs of a chessboard to correspondences, and from those to the camera by eq. (7)-(10).

A flat board alone gives eq. (9) no depth. So the boards of all views are placed in one frame, the camera's,
by the poses of our own bundle adjustment (`_bundle`; nothing of OpenCV's calibration is used), the lens is
taken out of the corners, and K, R, C come from all of them at once by eq. (7)-(10). The poses carry a K of
their own, hence (7)-(10) does not measure a second time: it has all eleven parameters free and must return
that K, R = I and C = 0 up to noise.

OpenCV finds the corners, and its calibrateCamera stands beside the result for comparison.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis_vision.calibrate.bundle import LENS, Bundle, adjust, free_parameters, undetermined
from quadvis_vision.calibrate.deviations import Deviations, bundle_deviations
from quadvis_vision.calibrate.residuals import rms
from quadvis_vision.camera.calibration import CameraCalibration
from quadvis_vision.camera.homogeneous import HomogeneousCalibration, calibrate
from quadvis_vision.camera.provenance import CalibrationError, Evidence
from quadvis_vision.pictures.reader import CodedPicture, read_coded, turned_note

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]
    Picture = NDArray[np.uint8]

# OpenCV's calibration sample uses this half width. Where squares look small, neighbours pull corners away.
USUAL_WINDOW = 11
_SMALLEST_WINDOW = 2
# Half widths over the distance between corners; from 0.4 on the residuals of a view double.
_CLEAR, _CROWDED = 0.3, 0.4
# Terms of the lens to do without, one set after the other, until it does not fold the picture.
_OMITTED: tuple[tuple[str, ...], ...] = ((), ("k3",), ("k2", "k3"), LENS)


@dataclass(frozen=True)
class Board:
    """A chessboard by its inner corners: columns x rows of them, `square` apart (any unit of length)."""

    columns: int
    rows: int
    square: float

    def __post_init__(self) -> None:
        """Refuse boards that cannot be found."""
        if min(self.columns, self.rows) < 3:
            raise QuadvisError(
                f"a {self.columns}x{self.rows} board is too small; count inner corners, at least 3x3"
            )
        if not 0 < self.square < np.inf:
            raise QuadvisError(
                f"a square of {self.square:g} is not a size; give the side of one square, above 0"
            )

    @property
    def points(self) -> Floats:
        """The corners (n, 2), row by row, in the unit of `square`."""
        row, column = np.indices((self.rows, self.columns), dtype=float)
        return np.column_stack([column.ravel(), row.ravel()]) * self.square


@dataclass(frozen=True, eq=False)
class Corners:
    """The corners (n, 2) of the board in one picture, in pixels; `crowded` if neighbours were in the way."""

    pixels: Floats
    crowded: bool


@dataclass(frozen=True, eq=False)
class Views:
    """The m pictures out of several that show the board.

    `names` and `corners` (n, 2) of each; `size`, the width and height of all pictures; `missed`, the paths of
    those without the board; `crowded`, the names of those with crowded corners; `notes`, what to say of the
    files, such as that one is there twice; `picture`, the last, in grey.
    """

    names: list[str]
    corners: list[Floats]
    size: tuple[int, int]
    missed: list[str]
    crowded: list[str]
    notes: list[str]
    picture: Picture


@dataclass(frozen=True, eq=False)
class ChessboardCalibration:
    """A camera from m views of a board.

    `homogeneous` is K, R, C of eq. (7)-(10) from the corners without the lens, in the frame of `bundle`,
    which has the poses, the lens and the camera they were found with. `camera` is K of eq. (7)-(10) with that
    lens, as the file holds it. `measured` corners are (m, n, 2) in pixels, `predicted` ones follow from
    `camera` and `homogeneous`. `bundle_rms` is what the bundle itself leaves, in pixels. `omitted` names
    terms of the lens that are held at zero: corners that do not go out far enough let the lens fold what lies
    beyond them. `deviations` are those of the bundle, whose K that of (7)-(10) repeats.
    """

    homogeneous: HomogeneousCalibration
    bundle: Bundle
    bundle_rms: float
    camera: CameraCalibration
    measured: Floats
    predicted: Floats
    deviations: Deviations
    omitted: tuple[str, ...] = ()

    @property
    def rms(self) -> float:
        """The rms distance over all corners as measured, in pixels."""
        return float(rms((self.predicted - self.measured).reshape(-1, 2)))

    @property
    def errors(self) -> Floats:
        """The rms distance (m,) of measured from predicted corners in each view, in pixels."""
        return rms(self.predicted - self.measured)


def find_corners(picture: Picture, board: Board, window: int | None = USUAL_WINDOW) -> Corners | None:
    """Return the inner corners of the board to a fraction of a pixel, or None if not all of it is in view.

    window is half the width in pixels of the surroundings that refine a corner; None keeps it clear of the
    neighbouring corners in every picture, which is the better choice wherever squares look small.
    """
    import cv2

    found, coarse = cv2.findChessboardCorners(picture, (board.columns, board.rows))
    if not found:
        return None
    # OpenCV 4 returns (n, 1, 2), OpenCV 5 (n, 2).
    start: Any = np.ascontiguousarray(np.reshape(coarse, (-1, 2)), dtype=np.float32)
    distance = _closest(start, board)
    half = window or int(np.clip(_CLEAR * distance, _SMALLEST_WINDOW, USUAL_WINDOW))
    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 30, 0.01)
    fine = cv2.cornerSubPix(picture, start, (half, half), (-1, -1), criteria)
    return Corners(np.reshape(fine, (-1, 2)).astype(float), half > _CROWDED * distance)


def read_views(
    paths: Sequence[str], board: Board, window: int | None = USUAL_WINDOW, least: int = 3
) -> Views:
    """Return the corners of the board in photographs; those that do not show it are left out.

    A picture that is there twice counts once, whatever its files are called: it is known by its pixels.

    `QuadvisError` if fewer than `least` show it, if one is no picture, or if they differ in size.
    """
    read: list[CodedPicture] = []
    first: dict[bytes, str] = {}  # by what the pixels hash to
    again: list[str] = []
    found: list[tuple[str, Corners | None]] = []
    for path in paths:
        read.append(replace(coded := read_coded(path), data=b""))
        if coded.size != read[0].size:
            sizes = [f"{width}x{height}" for width, height in (coded.size, read[0].size)]
            raise QuadvisError(
                f"{path} is {sizes[0]} but {paths[0]} is {sizes[1]}; one camera gives one size"
            )
        picture = coded.decode(grey=True)
        same = first.setdefault(sha256(picture.tobytes()).digest(), path)
        if len(first) == len(found):
            again.append(f"{path} is the same picture as {same} and counts once")
            continue
        found.append((path, find_corners(picture, board, window)))
    seen = [(Path(path).name, corners) for path, corners in found if corners is not None]
    if len(seen) < least:
        wanted = f"a board of {board.columns}x{board.rows} inner corners"
        raise QuadvisError(
            "; ".join(
                [
                    f"{wanted} was found in {len(seen)} of {len(found)} pictures; it takes {least} or more",
                    *again,
                ]
            )
        )
    return Views(
        names=[name for name, _ in seen],
        corners=[corners.pixels for _, corners in seen],
        size=read[0].size,
        missed=[path for path, corners in found if corners is None],
        crowded=[name for name, corners in seen if corners.crowded],
        notes=[*again, *turned_note(read)],
        picture=picture,
    )


def calibrate_views(
    board: Board, views: Sequence[Floats], size: tuple[int, int], *, skew: bool = False
) -> ChessboardCalibration:
    """Return the camera from the corners (n, 2) of 3 or more views; size is width and height in pixels.

    skew lets the poses' own camera have one too; eq. (7)-(10) leaves it free in any case.

    `QuadvisError` for too few views, or views that do not determine a camera.
    """
    measured = np.asarray(views, dtype=float)
    bundle, bent, omitted = _adjusted(board, measured, size, skew)
    placed = bundle.place(board.points).reshape(-1, 3)
    pixels = measured.reshape(-1, 2)
    straight = CameraCalibration(size, bundle.matrix, np.zeros(5))
    homogeneous = calibrate(placed, straight.to_pixels(bent.normalise(pixels)))
    camera = replace(bent, matrix=homogeneous.matrix)
    seen = (placed - homogeneous.centre) @ homogeneous.rotation.T
    predicted = camera.project(seen).reshape(measured.shape)
    points = seen.reshape(*measured.shape[:2], 3)
    camera = replace(camera, evidence=Evidence.of([*points], [*measured], [*predicted]))
    bundle_rms = float(rms(bent.project(placed) - pixels))
    free = free_parameters(skew=skew, lens=[name for name in LENS if name not in omitted])
    deviations = bundle_deviations(bundle, board.points, measured, free)
    return ChessboardCalibration(
        homogeneous, bundle, bundle_rms, camera, measured, predicted, deviations, omitted
    )


def at_heights(
    board: Board, views: Sequence[Floats], heights: Sequence[float]
) -> tuple[list[Floats], list[Floats]]:
    """Return points (n, 3) and pixels (n, 2) of each view of a board that was moved along its normal alone.

    heights are those of the views (n, 2) in the unit of the board; z goes toward the camera. x follows that
    edge of the board which goes most to the right in the first picture, y is up from it.
    """
    points, pixels, right = [], [], np.array([1.0, 0.0])
    for view, height in zip(views, heights, strict=True):
        grid = _turned(np.reshape(view, (board.rows, board.columns, 2)), right)
        right = _along(grid)
        row, column = np.indices(grid.shape[:2], dtype=float).reshape(2, -1)
        flat = np.column_stack((column, -row)) * board.square
        points.append(np.column_stack((flat, np.full(len(flat), height))))
        pixels.append(grid.reshape(-1, 2))
    return points, pixels


def _turned(grid: Floats, right: Floats) -> Floats:
    """Return the corners (rows, columns, 2) in the order that has its columns most along a direction.

    Which corner of a board comes first is OpenCV's choice, and may change from one picture to the next.
    """
    down = (grid[-1] - grid[0]).mean(axis=0)
    across = _along(grid)
    if across[0] * down[1] - across[1] * down[0] < 0:
        grid = grid[:, ::-1]
    quarters = range(4) if grid.shape[0] == grid.shape[1] else (0, 2)
    return max(
        (np.rot90(grid, turns) for turns in quarters), key=lambda turned: float(_along(turned) @ right)
    )


def _along(grid: Floats) -> Floats:
    """Return the direction from the first column to the last, (2,)."""
    return np.asarray((grid[:, -1] - grid[:, 0]).mean(axis=0))


def _adjusted(
    board: Board, views: Floats, size: tuple[int, int], skew: bool
) -> tuple[Bundle, CameraCalibration, tuple[str, ...]]:
    """Return the bundle, its camera, and the terms of the lens that were left out because of folds."""
    for omitted in _OMITTED:
        lens = [name for name in LENS if name not in omitted]
        bundle = adjust(board.points, views, size, skew=skew, lens=lens)
        try:
            return bundle, CameraCalibration(size, bundle.matrix, bundle.distortion), omitted
        except CalibrationError as error:
            if error.field != "distortion":  # such as a focal length below 0
                raise undetermined() from None
    raise QuadvisError(
        "no lens fits the corners without folding the picture; are they from one camera and one board?"
    )


def _closest(corners: Floats, board: Board) -> float:
    """Return the smallest distance in pixels of neighbours in a row or a column."""
    grid = np.asarray(corners, dtype=float).reshape(board.rows, board.columns, 2)
    steps = [np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1)]
    return float(min(steps))
