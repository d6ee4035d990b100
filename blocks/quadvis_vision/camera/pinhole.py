"""A pinhole camera with a lens, point by point in plain numbers.

`CameraCalibration` does the same for many points at once.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from quadvis_vision.camera.lens import Lens, distorted

Slopes = tuple[float, float, float, float]  # u by x, u by y, v by x, v by y

_ITERATIONS = 50
_TOLERANCE = 1e-13  # of a normalised coordinate: far below a millionth of a pixel
_AT_REST = 1e-9
NUMBERS = 10  # fx, s, cx, fy, cy, k1, k2, p1, p2, k3: what `pinhole` makes a camera of


class Pinhole(NamedTuple):
    """The matrix K = [[fx, skew, cx], [0, fy, cy], [0, 0, 1]] in px, and the lens.

    `bends` says whether the lens bends anything.
    """

    fx: float
    skew: float
    cx: float
    fy: float
    cy: float
    lens: Lens
    bends: bool


def pinhole(numbers: Sequence[float]) -> Pinhole:
    """Return the camera of ten numbers: fx, skew, cx, fy, cy (px), k1, k2, p1, p2, k3."""
    lens = (float(numbers[5]), float(numbers[6]), float(numbers[7]), float(numbers[8]), float(numbers[9]))
    k1, k2, p1, p2, k3 = lens
    bends = k1 != 0 or k2 != 0 or p1 != 0 or p2 != 0 or k3 != 0
    return Pinhole(
        float(numbers[0]), float(numbers[1]), float(numbers[2]), float(numbers[3]), float(numbers[4]),
        lens, bends,
    )  # fmt: skip


def normalised(camera: Pinhole, u: float, v: float) -> tuple[float, float]:
    """Return the normalised point that a pixel shows; NaN if no ray reaches the pixel through this lens."""
    y = (v - camera.cy) / camera.fy
    x = (u - camera.cx - camera.skew * y) / camera.fx
    return _undistorted(x, y, camera.lens) if camera.bends else (x, y)


def pixel(camera: Pinhole, x: float, y: float) -> tuple[float, float]:
    """Return the pixel of a normalised point."""
    if camera.bends:
        x, y, _, _, _ = distorted(x, y, camera.lens)
    return camera.fx * x + camera.skew * y + camera.cx, camera.fy * y + camera.cy


def pixel_slopes(camera: Pinhole, x: float, y: float) -> Slopes:
    """Return the derivatives of the pixel by the normalised point."""
    if not camera.bends:
        return camera.fx, camera.skew, 0.0, camera.fy
    _, _, xx, xy, yy = distorted(x, y, camera.lens)
    return (
        camera.fx * xx + camera.skew * xy, camera.fx * xy + camera.skew * yy, camera.fy * xy, camera.fy * yy,
    )  # fmt: skip


def _undistorted(x: float, y: float, lens: Lens) -> tuple[float, float]:
    """Invert the distortion by Newton's method; NaN where no point fits, or only one behind a fold."""
    found_x, found_y = x, y
    bent_x, bent_y, xx, xy, yy = distorted(found_x, found_y, lens)
    for _ in range(_ITERATIONS):
        area = xx * yy - xy * xy
        if area == 0:
            break
        right, down = x - bent_x, y - bent_y
        step_x, step_y = (right * yy - down * xy) / area, (down * xx - right * xy) / area
        found_x, found_y = found_x + step_x, found_y + step_y
        bent_x, bent_y, xx, xy, yy = distorted(found_x, found_y, lens)
        if not (abs(step_x) > _TOLERANCE or abs(step_y) > _TOLERANCE):
            break
    at_rest = abs(bent_x - x) < _AT_REST and abs(bent_y - y) < _AT_REST
    return (found_x, found_y) if at_rest and xx * yy - xy * xy > 0 else (math.nan, math.nan)
