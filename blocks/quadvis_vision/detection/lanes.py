"""Arithmetic of many circles at once, in an order that loops over single numbers can have as well.

Arrays end with an axis of circles or of rays. Sums are written out: the order of a sum by numpy depends on
shapes and strides, and that of a product of matrices on the processor. `loops` has the same for machine code,
which gives the same bits.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.detection.ray_numbers import POINT, SCATTER

Array = NDArray[Any]
Pixels = NDArray[np.uint8]

CHANNELS = np.arange(3).reshape(3, 1, 1, 1)


class Ellipses(NamedTuple):
    """Measured ellipses: `centres` (n, 2) px, and `shapes` (n, 2, 2) px, maps from the unit circle.

    `lights` and `paints` (3, n) are the colours around and inside them. `hidden` (n, rays) says which rays
    show no edge of the paint; `weights` (n,) from 0 to 1 how far the rays agree, in the mean. `blur` (9, n)
    and `scatter` (6, n) are sums over the rays for the width of the edge and the covariance of the centre.
    """

    centres: Array
    shapes: Array
    lights: Array
    paints: Array
    hidden: Array
    weights: Array
    blur: Array
    scatter: Array


def sampled(pixels: Pixels, u: Array, v: Array) -> Array:
    """Return the colours (3, *shape) between pixels at places (u, v) with three axes; edges go on outside."""
    height, width, _ = pixels.shape
    u = np.minimum(np.maximum(u, 0.0), width - 1.0)
    v = np.minimum(np.maximum(v, 0.0), height - 1.0)
    left, top = np.minimum(np.floor(u), width - 2.0), np.minimum(np.floor(v), height - 2.0)
    right, low = u - left, v - top
    first = (3.0 * (top * width + left)).astype(np.int64) + CHANNELS
    flat = pixels.reshape(-1)
    below = first + 3 * width
    upper = np.take(flat, first) * (1 - right) + np.take(flat, first + 3) * right
    lower = np.take(flat, below) * (1 - right) + np.take(flat, below + 3) * right
    return np.asarray(upper * (1 - low) + lower * low)


def summed(values: Array) -> Array:
    """Return the sums over the last axis, whose length is a power of two."""
    half = values.shape[-1] // 2
    total = values[..., :half] + values[..., half:]
    while half > 1:
        half //= 2
        total = total[..., :half] + total[..., half:]
    return total[..., 0]


def product(first: Any, second: Any) -> Any:
    """Return the scalar products (...) of vectors (3, ...)."""
    return first[0] * second[0] + first[1] * second[1] + first[2] * second[2]


def middle(values: Array) -> Array:
    """Return the median over the last axis, the upper one of the two."""
    half = values.shape[-1] // 2
    return np.asarray(np.partition(values, half)[..., half])


def solved(equations: Array) -> Array:
    """Return the solutions (k, n) of positive definite equations (k, k + 1, n) by Gauss and Jordan."""
    size = len(equations)
    rows = equations.copy()
    for k in range(size):
        pivot = rows[k] / rows[k, k]
        rows = rows - rows[:, k, None] * pivot
        rows[k] = pivot
    return rows[:, size]


def stepped(dark: Any, low: float, high: float) -> Any:
    """Return 0 up to `low`, 1 from `high` on, and a straight slope between."""
    return np.minimum(np.maximum((dark - low) * (1 / (high - low)), 0.0), 1.0)


def floor(power: Any) -> Any:
    """Return the least variance of the colours around circles, from the squared contrast."""
    return SCATTER[0] * SCATTER[0] * power + SCATTER[1] * SCATTER[1]


def radii_of(shapes: Array) -> Array:
    """Return the radii (n,) of circles with the areas of ellipses (n, 2, 2); one that has none is a point."""
    areas = shapes[:, 0, 0] * shapes[:, 1, 1] - shapes[:, 0, 1] * shapes[:, 1, 0]
    radii: Array = np.sqrt(np.maximum(np.abs(areas), POINT * POINT))
    return radii
