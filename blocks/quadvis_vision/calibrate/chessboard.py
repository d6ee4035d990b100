"""From photographs of a chessboard to correspondences, and from those to the camera by eq. (7)-(10).

A flat board alone gives eq. (9) no depth. So our own bundle adjustment (`bundle`) places the boards of all
views in one frame, the camera's. Then the lens is removed from the corners, and K, R, C follow from all
corners at once by eq. (7)-(10). The bundle has already found a K, hence (7)-(10) is no second measurement:
with all eleven parameters free it must return that K, R = I and C = 0 up to noise.

OpenCV finds the corners. Its calibrateCamera is used for comparison only.
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

# OpenCV's calibration sample uses this half width. Where squares look small, neighbouring corners disturb.
USUAL_WINDOW = 11
_SMALLEST_WINDOW = 2
# Half width divided by the distance between corners; from 0.4 on the residuals of a view double.
_CLEAR, _CROWDED = 0.3, 0.4
# Terms of the lens to omit: one set after the other is tried until the lens does not fold the picture.
_OMITTED: tuple[tuple[str, ...], ...] = ((), ("k3",), ("k2", "k3"), LENS)


@dataclass(frozen=True)
class Board:
    """A chessboard with columns x rows inner corners, `square` apart (any unit of length)."""

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
    """The corners (n, 2) of the board in one picture (px); `crowded` if neighbouring corners are too near."""

    pixels: Floats
    crowded: bool


@dataclass(frozen=True, eq=False)
class Views:
    """The m pictures that show the board, out of all that were read.

    `names` and `corners` (n, 2) belong to these; `size` is the width and height of all pictures; `missed` are
    the paths of pictures without the board; `crowded` are the names of pictures with crowded corners; `notes`
    are sentences for the user, such as one about a picture that was given twice; `picture` is the last
    picture, in grey.
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

    `bundle` holds the poses, the lens, and the camera of the bundle adjustment. `homogeneous` is K, R, C of
    eq. (7)-(10) from the corners without the lens, in the frame of `bundle`. `camera` is K of eq. (7)-(10)
    with the bundle's lens, as the file holds it. `measured` are the corners (m, n, 2) in pixels; `predicted`
    corners follow from `camera` and `homogeneous`. `bundle_rms` is the rms error of the bundle itself, in
    pixels. `omitted` names the terms of the lens that are held at zero, because the corners do not reach far
    enough out and the lens would fold the picture beyond them. `deviations` are the standard deviations of
    the bundle.
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

    window is half the width in pixels of the surroundings that refine a corner. With None it is chosen for
    each picture so that it contains no neighbouring corner; this is better where squares look small.
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

    A picture that is given twice counts once, whatever its files are called: pixels are compared, not names.

    `QuadvisError` if fewer than `least` pictures show the board, if a file is no picture, or if sizes differ.
    """
    read: list[CodedPicture] = []
    first: dict[bytes, str] = {}  # by the hash of the pixels
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

    skew says whether the bundle's camera may have a skew; in eq. (7)-(10) the skew is always free.

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
    """Return points (n, 3) and pixels (n, 2) of each view of a board that was moved only along its normal.

    heights are the heights of the board in the views (n, 2), in the unit of the board; z points toward the
    camera. x is along the edge of the board that points most to the right in the first picture, y is up.
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
    """Return the corners (rows, columns, 2), turned so that columns follow each other most along a direction.

    OpenCV chooses which corner of a board comes first; its choice may change from one picture to the next.
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
    """Return the bundle, its camera, and the terms of the lens that were omitted to avoid folds."""
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
