"""Look again and again until circles stay where they are; how wide their edges and how whole they are."""

from __future__ import annotations

import math

import numpy as np

from quadvis_vision.detection.lanes import Array, Ellipses, Pixels, product, radii_of
from quadvis_vision.detection.ray_numbers import RAYS
from quadvis_vision.detection.rays import look

HIDDEN = 5  # hidden rays side by side that make a hidden part: less than a tenth of the diameter
SHARE_MIN = 0.3  # of all rays that must agree
WIDEST = 3.0  # px: the width of an edge, at most
SHARP = 0.9  # px: the width of an edge that is as sharp as the lens and the pixels allow
SOFT = (0.92, 1.4)  # of the contrast: if short rays see less of it, edges are at least so wide (px)
BLURRED = 0.1  # px: edges that are wider than was thought by more are looked at again
REACH = (2.6, 5.0)  # px: half the length of a ray for a sharp edge, and how it grows with the edge's width
FIRST = (0.6, 6.0)  # of the radius, and px: half the length of rays where the width is not known
STEADY = 0.4  # px: an edge that moves less from look to look is final
LOOKS = 3
NEIGHBOURS = 2.0  # how far the variance grows since neighbouring rays see the same pixels
APART = 0.35  # px: the deviation of a centre whose rays do not agree at all
SMALL = 0.035  # px^2: over the radius, the deviation by the size of pixels
BLUR = 2.0  # grey levels over px: times the squared width of the edge and over the contrast
LITTLE = 1e-6  # the least determinant: of a circle without rays


def settle(pixels: Pixels, centres: Array, radii: Array) -> Ellipses:
    """Look until circles with rough radii (n,) stay where they are, whatever their shapes and edges are."""
    shapes = np.zeros((len(radii), 2, 2))
    shapes[:, 0, 0] = shapes[:, 1, 1] = radii
    found = look(pixels, centres, shapes, np.minimum(FIRST[0] * radii, FIRST[1]), 0.0)
    turns = 1
    while turns < LOOKS and not _steady(found, centres, radii):
        centres, shapes = found.centres, found.shapes
        radii = radii_of(shapes)
        found = look(pixels, centres, shapes, np.minimum(FIRST[0] * radii, FIRST[1]), 0.0)
        turns += 1
    return found


def _steady(found: Ellipses, centres: Array, radii: Array) -> bool:
    """Return whether ellipses are where a look expected them, with the sizes it expected."""
    moved = np.abs(found.centres - centres).max()
    grown = np.abs(radii_of(found.shapes) - radii).max()
    return bool(max(moved, grown) < STEADY)


def sharpen(
    pixels: Pixels, centres: Array, shapes: Array, width: float, contrast: Array
) -> tuple[Ellipses, float, bool]:
    """Look with short rays until the ellipses, of known shapes, stay where they are.

    `width` (px) is that of the edges, 0 if it is not known; then `contrast` (n,) is that of the circles, of
    which short rays see less where edges are wide. The second value is the width that was measured. The third
    is whether the first look found the ellipses where they were expected.
    """
    radii = radii_of(shapes)
    found = look(pixels, centres, shapes, np.full(len(radii), reach_for(width)), 1.0)
    steady = first = _steady(found, centres, radii)
    before, width = max(width, SHARP), max(width, edge_width(found))
    seen = np.sort(contrasts(found) / contrast)
    if seen[len(seen) // 2] < SOFT[0]:
        width = max(width, SOFT[1])
    turns = 1
    while turns < LOOKS and not (steady and width - before < BLURRED):
        centres = found.centres
        found = look(pixels, centres, shapes, np.full(len(radii), reach_for(width)), 1.0)
        steady = _steady(found, centres, radii)
        before, width = max(width, SHARP), max(width, edge_width(found))
        turns += 1
    return found, width, first


def contrasts(found: Ellipses) -> Array:
    """Return the distances (n,) of the colours inside ellipses from those around them, in grey levels."""
    away = found.lights - found.paints
    distances: Array = np.sqrt(product(away, away))
    return distances


def reach_for(width: float) -> float:
    """Return half the length (px) of rays that an edge of some width needs."""
    return REACH[0] + REACH[1] * max(0.0, width - SHARP)


def edge_width(found: Ellipses) -> float:
    """Return the width (px, a standard deviation) of the edges of all ellipses, where the blur is largest."""
    one, bent, both, turned, crossed, other, mean, along, across = _all(found.blur)
    one, both, other = one + 1e-6, both + 1e-6, other + 1e-6
    # Elimination in the order of the triangle: mean, along, across.
    p, q = bent / one, turned / one
    both, crossed, other = both - p * bent, crossed - p * turned, other - q * turned
    along, across = along - p * mean, across - q * mean
    r = crossed / both
    across = (across - r * along) / (other - r * crossed)
    along = (along - crossed * across) / both
    mean = (mean - bent * along - turned * across) / one
    return min(math.sqrt(max(0.0, mean + math.sqrt(along * along + across * across))), WIDEST)


def _all(blur: Array) -> Array:
    """Return the sums (9,) over all circles."""
    total = blur[:, 0].copy()
    for k in range(1, blur.shape[1]):
        total += blur[:, k]
    return total


def deviations(found: Ellipses, width: float) -> Array:
    """Return the standard deviations (n,) in px of each coordinate of the centres; `width` is the edges'.

    The covariance of a fit by weights w with residuals r is N^-1 V N^-1 with N = sum w x x' and V =
    sum w^2 r^2 x x' (White 1980), times a factor for neighbouring rays, which see the same pixels. What the
    residuals do not show is added by its measured size: rays that agree on something beside the circle, the
    pixels' size, and noise on blurred edges, which is the same along many rays.
    """
    result, radii, light = np.empty(len(found.weights)), radii_of(found.shapes), contrasts(found)
    for k in range(len(result)):
        n, v, s = found.scatter[:3, k], found.scatter[3:, k], found.shapes[k]
        area = max(n[0] * n[2] - n[1] * n[1], LITTLE)
        spread = 0.0
        for i in range(2):  # the rows of the shape times N^-1 = [[n2, -n1], [-n1, n0]] / area
            p = (s[i, 0] * n[2] - s[i, 1] * n[1]) / area
            q = (s[i, 1] * n[0] - s[i, 0] * n[1]) / area
            spread += p * p * v[0] + 2 * p * q * v[1] + q * q * v[2]
        apart = APART * (1 - found.weights[k]) * (1 - found.weights[k])
        small, blurred = SMALL / radii[k], BLUR * width * width / max(light[k], 1.0)
        result[k] = math.sqrt(NEIGHBOURS * spread / 2 + apart * apart + small * small + blurred * blurred)
    return result


def symmetry(found: Ellipses) -> Array:
    """Return (n,) 1 for a whole ellipse, less for each hidden ray, below 0.9 if a part is hidden."""
    result = np.ones(len(found.weights))
    for k in range(len(result)):
        result[k] -= 0.1 * _longest_run(found.hidden[k]) / (HIDDEN - 0.5)
        if found.weights[k] < SHARE_MIN:
            result[k] = min(result[k], 0.9 * found.weights[k] / SHARE_MIN)
    return result


def _longest_run(flags: Array) -> int:
    """Return the number of flags side by side that are true, at most, around a circle."""
    longest = run = 0
    if flags.any():
        for turn in range(2 * RAYS):
            run = run + 1 if flags[turn % RAYS] else 0
            longest = max(longest, run)
    return min(longest, RAYS)
