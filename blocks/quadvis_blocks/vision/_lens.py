"""The lens: OpenCV's distortion k1, k2, p1, p2, k3 of normalised coordinates, and its derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]


def distort(normalised: Floats, lens: Floats) -> Floats:
    """Return normalised coordinates (..., 2) after the lens (5,)."""
    _, _, p1, p2, _ = lens
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    radial = _radial(r2, lens)
    bent_x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    bent_y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.stack([bent_x, bent_y], axis=-1)


def by_point(normalised: Floats, lens: Floats) -> Floats:
    """Return the derivatives (..., 2, 2) of the distorted coordinates by the undistorted ones (..., 2)."""
    k1, k2, p1, p2, k3 = lens
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    radial = _radial(r2, lens)
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * k3 * r2))
    along_x = radial + slope * x * x + 2 * p1 * y + 6 * p2 * x
    along_y = radial + slope * y * y + 6 * p1 * y + 2 * p2 * x
    mixed = slope * x * y + 2 * (p1 * x + p2 * y)
    return _matrix([along_x, mixed], [mixed, along_y])


def by_lens(normalised: Floats) -> Floats:
    """Return the derivatives (..., 2, 5) of the distorted coordinates by k1, k2, p1, p2, k3."""
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    tangential = 2 * x * y
    return _matrix(
        [x * r2, x * r2**2, tangential, r2 + 2 * x * x, x * r2**3],
        [y * r2, y * r2**2, r2 + 2 * y * y, tangential, y * r2**3],
    )


def _radial(r2: Floats, lens: Floats) -> Floats:
    k1, k2, _, _, k3 = lens
    return np.asarray(1 + r2 * (k1 + r2 * (k2 + r2 * k3)))


def _matrix(first: list[Floats], second: list[Floats]) -> Floats:
    return np.stack([np.stack(first, axis=-1), np.stack(second, axis=-1)], axis=-2)
