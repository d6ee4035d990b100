"""OpenCV's calibrateCamera on the same correspondences, for comparison."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class OpenCVCalibration:
    """The result of cv2.calibrateCamera: K (3, 3), lens (5,), rms (px) of all corners and (m,) by view."""

    matrix: Floats
    distortion: Floats
    rms: float
    errors: Floats


def calibrate_views(board: Floats, views: Sequence[Floats], size: tuple[int, int]) -> OpenCVCalibration:
    """Return the camera from views (n, 2) of a board (n, 2), with OpenCV's usual flags: no skew."""
    import cv2

    points: Any = np.column_stack([board, np.zeros(len(board))]).astype(np.float32)
    pixels: Any = [np.asarray(view, dtype=np.float32).reshape(-1, 1, 2) for view in views]
    guess: Any = None
    error, matrix, lens, _, _, _, _, errors = cv2.calibrateCameraExtended(
        [points] * len(pixels), pixels, size, guess, guess
    )
    return _calibration(error, matrix, lens, errors)


def calibrate_points(points: Floats, pixels: Floats, guess: Floats) -> OpenCVCalibration | None:
    """Return the camera from points in space (n, 3) and their pixels (n, 2), without a lens and without skew.

    For points that are not in one plane OpenCV has no closed form: it starts from K = guess (3, 3). It
    refuses some guesses, such as a principal point to the left of the picture or above it; then this returns
    None.
    """
    import cv2

    start: Any = guess.copy()
    start[0, 1] = 0.0
    lens: Any = np.zeros(5)
    flags = cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3 | cv2.CALIB_ZERO_TANGENT_DIST
    size = (int(guess[0, 2]) + 2, int(guess[1, 2]) + 2)  # OpenCV only compares it with the principal point
    try:
        error, matrix, lens, _, _, _, _, errors = cv2.calibrateCameraExtended(
            [(points - points.mean(axis=0)).astype(np.float32)],
            [pixels.astype(np.float32).reshape(-1, 1, 2)],
            size,
            start,
            lens,
            flags=flags | cv2.CALIB_USE_INTRINSIC_GUESS,
        )
    except cv2.error:
        return None
    return _calibration(error, matrix, lens, errors)


def _calibration(error: float, matrix: Any, lens: Any, errors: Any) -> OpenCVCalibration:
    arrays = [np.asarray(array, dtype=float) for array in (matrix, np.ravel(lens)[:5], np.ravel(errors))]
    return OpenCVCalibration(arrays[0], arrays[1], float(error), arrays[2])
