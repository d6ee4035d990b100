"""The share of each pixel that a disc on the ceiling covers, from the distance and direction of its edge."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def edge_coverage(back: Array, radius: float, middles: Array, rays: Array, turn: Array) -> Array:
    """Return the covered share of pixels from the distance (px) and direction of their disc's edge.

    `middles` (2, n) are the centres of the discs (m); `turn` (4, n or 1) holds the derivatives of the `rays`
    (3, n) by the pixels: those of x by u and v, and those of y.
    """
    met = back @ rays
    w = np.maximum(met[2], 1e-9)  # a ray that does not go up never meets the ceiling
    arm = met[:2] - middles * w
    m = np.maximum(np.hypot(*arm), 1e-12)
    along, arm = arm * middles, arm / m
    out = (along[0] + along[1] + m * m / w) / m
    by_x, by_y = arm[0] * back[0, :2, None] + arm[1] * back[1, :2, None] - out * back[2, :2, None]
    along = by_x * turn[:2] + by_y * turn[2:]
    steepness = np.maximum(np.hypot(*along), 1e-12)
    # The edge deviates from its tangent: on average over a pixel's width by 1/24 of the curvature.
    bend = steepness / (24 * radius * w)
    return half_plane_share((m - radius * w) / steepness + bend, along / steepness)


def half_plane_share(distance: Array, normal: Array) -> Array:
    """Return the share of unit pixels in a half plane whose edge is `distance` px away along the `normal`.

    A positive distance means that the pixel's centre is outside. The share is the integral of the pixel's
    shadow along the normal (u, v), a trapezium.
    """
    u, v = np.abs(normal)
    long, short = np.maximum(u, v), np.maximum(np.minimum(u, v), 1e-9)
    away = np.abs(distance)
    ramp = away / long
    corner = np.maximum((long + short) / 2 - away, 0.0) ** 2 / (2 * long * short)
    inner = np.where(away <= (long - short) / 2, 0.5 - ramp, corner)
    return np.asarray(np.where(distance > 0, inner, 1 - inner))


def stretch(a: Any, b: Any, c: Any, d: Any) -> Any:
    """Return the larger singular value of the matrix [a b; c d], of floats or arrays."""
    return (np.hypot(a + d, b - c) + np.hypot(a - d, b + c)) / 2
