"""Maps from pixels to two planes, and the focal point and image plane from them: equations (1) to (6).

Vectors are rows, as in the published matrices (36): (x, y, z) = (rho, gamma, 1) H.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from quadvis.errors import QuadvisError
from quadvis_vision.camera.homogeneous import homography

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    Floats = NDArray[np.float64]

PARALLEL = 1e-9  # relative size below which lines count as parallel and a map as singular


def affine_map(pixels: ArrayLike, points: ArrayLike) -> Floats:
    """Return H (3, 3) with points (n, 3) ~ (rho, gamma, 1) H, least squares over pixels (n, 2), eq. (3).

    All points have the same z. `QuadvisError` if the pixels are fewer than 3 or lie on a line.
    """
    q, g = homogeneous(pixels), np.asarray(points, dtype=float)
    if len(q) != len(g) or len(q) < 3:
        raise QuadvisError(f"{len(g)} points and {len(q)} pixels; a plane needs at least 3, one for each")
    if not np.isfinite(q).all():
        raise QuadvisError(
            "a pixel of a calibration plane is not finite; leave out points that were not seen"
        )
    centred = q[:, :2] - q[:, :2].mean(axis=0)
    extents = np.linalg.svd(centred, compute_uv=False)
    if not extents[1] > PARALLEL * extents[0]:
        raise QuadvisError("the pixels of a calibration plane lie on a line; spread them over the picture")
    h, *_ = np.linalg.lstsq(q, g, rcond=None)
    h[:, 2] = (0, 0, np.median(g[:, 2]))
    return np.asarray(h)


def projective_map(pixels: ArrayLike, points: ArrayLike) -> Floats:
    """Return H (3, 3) with (x w, y w, w) = (rho, gamma, 1) H for points (n, 3) and pixels (n, 2), n >= 4.

    Its largest element is 1 or -1. `QuadvisError` as for `homography`.
    """
    h = homography(pixels, np.asarray(points, dtype=float)[:, :2]).T
    return np.asarray(h / np.abs(h).max())


def apply(h: Floats, z: float, pixels: ArrayLike, *, projective: bool = False) -> Floats:
    """Return the images (n, 3) of pixels (n, 2) on the plane at height z, eq. (1)."""
    g = homogeneous(pixels) @ columns(h, projective)
    return np.column_stack([g[:, :2] / g[:, 2:], np.full(len(g), float(z))])


def focal_point(g1: ArrayLike, g2: ArrayLike) -> Floats:
    """Return F (3,), the point nearest to the lines through the rows of g1 and g2 (n, 3), by least squares.

    F = (sum (I - u u'))^-1 sum (I - u u') g1 over the unit directions u of the lines.

    `QuadvisError` if the lines are parallel.
    """
    start, u = np.asarray(g1, dtype=float), unit(np.asarray(g2, dtype=float) - np.asarray(g1, dtype=float))
    across = np.eye(3) - u[:, :, None] * u[:, None, :]
    normal = across.sum(axis=0)
    if not np.linalg.eigvalsh(normal)[0] > PARALLEL * len(u):
        raise QuadvisError(
            "the lines between the planes are parallel; the planes must differ in scale or shape"
        )
    return np.asarray(np.linalg.solve(normal, np.einsum("nij,nj->i", across, start)))


def image_plane(directions: ArrayLike, pixels: ArrayLike) -> tuple[Floats, Floats, Floats]:
    """Return V_R (3,), V_C (3,) and the piercing point (rho_p, gamma_p), eq. (5)-(6): X = W+ B.

    directions (n, 3) are the unit vectors of (4), n >= 4. In a small field of view the fourth column of W is
    almost a multiple of the third; only the curvature of the unit sphere separates them. Condition numbers of
    70 to 500 are usual.
    """
    v = np.asarray(directions, dtype=float)
    x, *_ = np.linalg.lstsq(
        np.column_stack([v, np.ones(len(v))]), np.asarray(pixels, dtype=float), rcond=None
    )
    return x[:3, 0], x[:3, 1], x[3]


def unit(vectors: Floats) -> Floats:
    """Return the rows (n, 3) scaled to length one."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))


def homogeneous(pixels: ArrayLike) -> Floats:
    """Return rows (rho, gamma, 1) of pixels (n, 2)."""
    q = np.asarray(pixels, dtype=float).reshape(-1, 2)
    return np.column_stack([q, np.ones(len(q))])


def columns(h: Floats, projective: bool) -> Floats:
    """Return the map to (x w, y w, w); for an affine map w is 1 everywhere."""
    return np.column_stack([h[:, :2], h[:, 2] if projective else (0.0, 0.0, 1.0)])
