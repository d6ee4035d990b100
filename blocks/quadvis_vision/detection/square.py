"""The geometry of a square in a picture: which four blobs are its corners, and the radii of circles on them.

Corners are numbered 1..4 clockwise from the upper left, as in section 5.1. Points are complex numbers u +
iv (px, v down), because a similarity is then one multiplication and one addition.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Homography = tuple[float, float, float, float, float, float, float, float, float]

# Corners of the unit square around the origin.
CORNERS = (complex(-0.5, -0.5), complex(0.5, -0.5), complex(0.5, 0.5), complex(-0.5, 0.5))

# Limits within which four blobs count as a square with four equal circles. A tilt of 25 deg, seen from 1.6
# sides away, deviates from a similarity by 0.1 side. Radii differ from the expected ones by noise, by blur,
# and by an inexact ratio of radius to side.
MISFIT_MAX = 0.3  # of the side, rms
SIZE_MAX = math.log(1.6)  # of all circles together
SPREAD_MAX = math.log(1.4)  # size of one circle relative to the others
OFFSET_MAX = 0.5  # of half a diagonal: distance of a corner from the place that two opposite corners predict


class Blob(NamedTuple):
    """A possible circle: `centre` u + iv and `radius` in px, `distance` of its colour from a circle's."""

    centre: complex
    radius: float
    distance: float


def square_homography(points: Sequence[complex]) -> Homography | None:
    """Return the homography, row by row, from the unit square (p right, q down, 0..1) to the picture.

    None if the corners do not form a convex figure numbered clockwise, as when the target is seen from
    behind. Source: the closed form for a unit square (Heckbert 1989), up to the scale H33 = 1.
    """
    p1, p2, p3, p4 = points
    up, left, bend = p2 - p3, p4 - p3, p1 - p2 + p3 - p4
    area = -_cross(up, left)
    if not area > 0:
        return None
    g, h = _cross(left, bend) / area, _cross(bend, up) / area
    if not (1 + g > 0 and 1 + h > 0 and 1 + g + h > 0):
        return None
    if not _cross(p2 - p1, p4 - p1) > 0:
        return None
    a, b = p2 - p1 + g * p2, p4 - p1 + h * p4
    return (a.real, b.real, p1.real, a.imag, b.imag, p1.imag, g, h, 1.0)


def expected_radii(points: Sequence[complex], ratio: float) -> tuple[float, float, float, float] | None:
    """Return the radii (px) of circles on the four corners; `ratio` is their radius over the square's side.

    A small circle becomes an ellipse, scaled in area by the Jacobian determinant det H / w^3 of the
    homography at its corner; its radius is that of the circle of equal area. None if the points are no
    square seen from the front.
    """
    h = square_homography(points)
    if h is None:
        return None
    across, down = 1 + h[6], 1 + h[7]
    determinant = _cross(points[1] - points[0], points[3] - points[0]) * across * down
    r1, r2, r3, r4 = (ratio * math.sqrt(determinant / w**3) for w in (1.0, across, across + down - 1, down))
    return r1, r2, r3, r4


def expected_shapes(points: Sequence[complex], ratio: float) -> Array | None:
    """Return the maps (4, 2, 2) from the unit circle to the images (px) of small circles on the four corners.

    Each is the derivative of the homography at its corner. None as for `expected_radii`.
    """
    h = square_homography(points)
    if h is None:
        return None
    maps = []
    for point, p, q in zip(points, (0.0, 1.0, 1.0, 0.0), (0.0, 0.0, 1.0, 1.0), strict=True):
        share = ratio / (h[6] * p + h[7] * q + 1)
        u, v = point.real, point.imag
        maps.append(
            (
                ((h[0] - u * h[6]) * share, (h[1] - u * h[7]) * share),
                ((h[3] - v * h[6]) * share, (h[4] - v * h[7]) * share),
            )
        )
    return np.array(maps)


def expected_bends(shapes: Array) -> list[complex]:
    """Return, for each map from the unit circle to an ellipse, the `bend` of a `Disc` of that ellipse."""
    squares = (shapes @ shapes.transpose(0, 2, 1)).tolist()
    return [complex(a - d, 2 * b) / max(a + d, 1e-9) for (a, b), (_, d) in squares]


def arrangement_cost(corners: Sequence[Blob], ratio: float) -> float:
    """Return the misfit of four blobs to a square of circles; infinity if they cannot be one."""
    points = [blob.centre for blob in corners]
    misfit = _misfit(points)
    if misfit > MISFIT_MAX:
        return math.inf
    expected = expected_radii(points, ratio)
    if expected is None:
        return math.inf
    colour = (corners[0].distance + corners[1].distance + corners[2].distance + corners[3].distance) / 4
    return misfit / MISFIT_MAX + _size_cost([blob.radius for blob in corners], expected) + colour


def square_cost(points: Sequence[complex], radii: Sequence[float], expected: Sequence[float]) -> float:
    """Return the misfit of four circles to a square with these expected radii, as `arrangement_cost` does."""
    misfit = _misfit(points)
    return math.inf if misfit > MISFIT_MAX else misfit / MISFIT_MAX + _size_cost(radii, expected)


def _size_cost(radii: Sequence[float], expected: Sequence[float]) -> float:
    sizes = [math.log(radius / other) for radius, other in zip(radii, expected, strict=True)]
    mean = sum(sizes) / 4
    spread = max(max(sizes) - mean, mean - min(sizes))
    if abs(mean) > SIZE_MAX or spread > SPREAD_MAX:
        return math.inf
    return abs(mean) / SIZE_MAX + spread / SPREAD_MAX


def arrangements(blobs: Sequence[Sequence[Blob]], ratio: float, most: int) -> list[tuple[Blob, ...]]:
    """Return up to `most` choices of one blob for each corner that fit a square, the best first."""
    found: list[tuple[float, tuple[Blob, ...]]] = []
    for first in blobs[0]:
        for third in blobs[2]:
            middle, half = (first.centre + third.centre) / 2, (third.centre - first.centre) / 2
            if not _sized(first, half, ratio) or not _sized(third, half, ratio):
                continue
            seconds = _near(blobs[1], middle - 1j * half, abs(half))
            fourths = _near(blobs[3], middle + 1j * half, abs(half)) if seconds else []
            for second in seconds:
                for fourth in fourths:
                    corners = (first, second, third, fourth)
                    cost = arrangement_cost(corners, ratio)
                    if cost < math.inf:
                        found.append((cost, corners))
    return [corners for _, corners in sorted(found, key=lambda pair: pair[0])[:most]]


def motion(before: Sequence[complex], after: Sequence[complex]) -> tuple[complex, complex, float]:
    """Return the similarity `factor * before + shift` nearest to `after`: factor, shift, and rms (px)."""
    count = len(before)
    origin, target = sum(before) / count, sum(after) / count
    size, turned = 0.0, 0j
    for p, q in zip(before, after, strict=True):
        arm = p - origin
        size += arm.real * arm.real + arm.imag * arm.imag
        turned += arm.conjugate() * (q - target)
    if not size > 0:
        return 1 + 0j, target - origin, math.inf
    factor = turned / size
    shift, left = target - factor * origin, 0.0
    for p, q in zip(before, after, strict=True):
        off = factor * p + shift - q
        left += off.real * off.real + off.imag * off.imag
    return factor, shift, math.sqrt(left / count)


def _misfit(points: Sequence[complex]) -> float:
    """Return the rms distance of the points from the best square, over that square's side.

    The discrete Fourier transform of the points has four parts: one is their middle, one is a square, and the
    other two are the distance.
    """
    p1, p2, p3, p4 = points
    along, across = p1 - p3, 1j * (p2 - p4)
    side = abs(along - across) * math.sqrt(2)
    return math.hypot(abs(along + across), abs(p1 + p3 - p2 - p4)) / side if side else math.inf


def _sized(blob: Blob, half: complex, ratio: float) -> bool:
    """Return whether the blob's radius agrees with half the diagonal, within the effect of tilt."""
    expected = ratio * abs(half) * math.sqrt(2)
    return expected < 2.2 * blob.radius and blob.radius < 2.2 * expected


def _near(blobs: Sequence[Blob], place: complex, half: float) -> list[Blob]:
    return [blob for blob in blobs if abs(blob.centre - place) < OFFSET_MAX * half]


def _cross(a: complex, b: complex) -> float:
    return a.real * b.imag - a.imag * b.real
