"""The lens: OpenCV's distortion k1, k2, p1, p2, k3 of normalised coordinates, and its derivatives."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

Lens = tuple[float, float, float, float, float]  # k1, k2, p1, p2, k3


def distorted(x: Any, y: Any, lens: Lens) -> tuple[Any, Any, Any, Any, Any]:
    """Return x and y after the lens, and the derivatives: x by x, x by y (which is y by x), and y by y.

    Coordinates are numbers, or arrays of one shape.
    """
    k1, k2, p1, p2, k3 = lens
    xx, xy, yy = x * x, x * y, y * y
    r2 = xx + yy
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    slope = 2 * (k1 + r2 * (2 * k2 + 3 * k3 * r2))  # d radial / dx = slope x
    along, across = 2 * (p1 * y + p2 * x), 2 * (p1 * x + p2 * y)
    return (
        x * radial + 2 * p1 * xy + p2 * (r2 + 2 * xx),
        y * radial + p1 * (r2 + 2 * yy) + 2 * p2 * xy,
        radial + slope * xx + along + 4 * p2 * x,
        slope * xy + across,
        radial + slope * yy + along + 4 * p1 * y,
    )


def distort(normalised: Floats, lens: Floats) -> Floats:
    """Return normalised coordinates (..., 2) after the lens (5,)."""
    return linearise(normalised, lens)[0]


def by_point(normalised: Floats, lens: Floats) -> Floats:
    """Return the derivatives (..., 2, 2) of the distorted coordinates by the undistorted ones (..., 2)."""
    return linearise(normalised, lens)[1]


def linearise(normalised: Floats, lens: Floats) -> tuple[Floats, Floats]:
    """Return normalised coordinates (..., 2) after the lens (5,), and their derivatives (..., 2, 2)."""
    k1, k2, p1, p2, k3 = lens.tolist()
    x, y, x_by_x, x_by_y, y_by_y = distorted(normalised[..., 0], normalised[..., 1], (k1, k2, p1, p2, k3))
    jacobian = np.stack((x_by_x, x_by_y, x_by_y, y_by_y), axis=-1)
    return np.stack((x, y), axis=-1), jacobian.reshape(*normalised.shape, 2)


def by_lens(normalised: Floats) -> Floats:
    """Return the derivatives (..., 2, 5) of the distorted coordinates by k1, k2, p1, p2, k3."""
    x, y = normalised[..., 0], normalised[..., 1]
    r2 = x * x + y * y
    tangential = 2 * x * y
    first = [x * r2, x * r2**2, tangential, r2 + 2 * x * x, x * r2**3]
    second = [y * r2, y * r2**2, r2 + 2 * y * y, tangential, y * r2**3]
    return np.stack([np.stack(first, axis=-1), np.stack(second, axis=-1)], axis=-2)
