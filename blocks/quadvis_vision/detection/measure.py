"""From rough places to measured circles, each as a row of numbers: the compiled part of the detector."""

from __future__ import annotations

import numpy as np

from quadvis.native.functions import native
from quadvis_vision.detection.approach import approach
from quadvis_vision.detection.lanes import Array, Ellipses, Pixels, radii_of
from quadvis_vision.detection.looks import contrasts, deviations, edge_width, settle, sharpen, symmetry

CONTRAST_MIN = 10.0  # grey levels between circle and ceiling, as a distance of colours
GROWTH_MAX = 2.0  # of a circle against its expected radius
BEND_MAX = 0.75  # of an ellipse that may be a circle: a tilt of 67 deg
SIZE_MIN = 0.5  # px: the least radius
JUMP = 0.3  # of a radius: after a larger movement of the target the rough places are taken once more

UNKNOWN = 1e-3  # grey levels: a contrast that nothing falls short of

COLUMNS = 12
"""Of a row: whether a circle is there; u, v and radius in px; colour over the ceiling's, blue, green, red;
real and imaginary part of the bend; symmetry; width of the edge and sigma of the centre in px. See `Disc`."""


@native(takes=("uint8[h,w,3]", "float64[n,3]"), gives=("float64[n,12]",))
def located(pixels: Pixels, guesses: Array) -> Array:
    """Return the circles (n, COLUMNS) near guesses (n, 3) of u, v and radius, wrong by half a radius."""
    expected = guesses[:, 2].copy()
    rough, radii, _ = approach(pixels, guesses[:, :2].copy(), expected)
    found = settle(pixels, rough, radii)
    return _rows(pixels, found, expected, edge_width(found))


@native(takes=("uint8[h,w,3]", "float64[n,2]", "float64[n,2,2]", "float64"), gives=("float64[n,12]",))
def remeasured(pixels: Pixels, centres: Array, shapes: Array, width: float) -> Array:
    """Return circles (n, COLUMNS) measured once more, with `shapes` in px and edges of a known width."""
    found, width, _ = sharpen(pixels, centres, shapes, width, np.full(len(centres), UNKNOWN))
    return _rows(pixels, found, radii_of(shapes), width)


@native(takes=("uint8[h,w,3]", "float64[4,6]", "float64[4,2,2]"), gives=("float64[4,12]", "float64"))
def followed(pixels: Pixels, places: Array, shapes: Array) -> tuple[Array, float]:
    """Return what is near the `places` (4, 6) of a `Detection`, measured as ellipses of these shapes.

    The second value is 0 if they moved or grew so much that their ellipses are others.
    """
    centres, radii = places[:, :2].copy(), places[:, 2].copy()
    rough, _, contrast = approach(pixels, centres, radii)
    right, down = np.sort(rough[:, 0] - centres[:, 0]), np.sort(rough[:, 1] - centres[:, 1])
    across, along = (right[1] + right[2]) / 2, (down[1] + down[2]) / 2
    jump = JUMP * radii.min()
    if across * across + along * along > jump * jump:
        centres[:, 0] += across
        centres[:, 1] += along
        rough, _, contrast = approach(pixels, centres, radii)
    found, width, exact = sharpen(pixels, rough, shapes, 0.0, contrast)
    return _rows(pixels, found, radii, width), 1.0 if exact else 0.0


def _rows(pixels: Pixels, found: Ellipses, expected: Array, width: float) -> Array:
    """Return the rows of ellipses; none is there that is no circle near the expected radii, or is cut."""
    height, wide, _ = pixels.shape
    sizes, lights, whole = radii_of(found.shapes), contrasts(found), symmetry(found)
    sigmas = deviations(found, width)
    rows = np.empty((len(expected), COLUMNS))
    for k in range(len(expected)):
        u, v, size = found.centres[k, 0], found.centres[k, 1], sizes[k]
        a, b, c, d = (
            found.shapes[k, 0, 0],
            found.shapes[k, 0, 1],
            found.shapes[k, 1, 0],
            found.shapes[k, 1, 1],
        )
        across, down, both = a * a + b * b, c * c + d * d, a * c + b * d
        total = max(across + down, 1e-9)
        real, imaginary = (across - down) / total, 2 * both / total
        # The picture ends half a pixel beyond the centres of its outermost pixels.
        room = min(u, v, wide - 1 - u, height - 1 - v) + 0.5
        there = lights[k] >= CONTRAST_MIN and size > SIZE_MIN and room >= size
        there = there and real * real + imaginary * imaginary < BEND_MAX * BEND_MAX
        there = there and size < GROWTH_MAX * expected[k] and expected[k] < GROWTH_MAX * size
        rows[k, 0] = 1.0 if there else 0.0
        rows[k, 1], rows[k, 2], rows[k, 3] = u, v, size
        for channel in range(3):
            rows[k, 4 + channel] = found.paints[channel, k] / max(found.lights[channel, k], 1.0)
        rows[k, 7], rows[k, 8], rows[k, 9] = real, imaginary, whole[k]
        rows[k, 10], rows[k, 11] = width, sigmas[k]
    return rows


NATIVE = (located, remeasured, followed)
