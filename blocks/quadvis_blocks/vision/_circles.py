"""Finding four coloured circles in a picture, fast and whatever the light.

The ceiling is the white reference: a pixel is compared with the local median of its surroundings, channel
by channel, and a circle is told by the ratio of its colour to the ceiling's, which neither exposure,
white balance nor vignetting changes. Centres are moments at full resolution, weighted by a soft step
around half the contrast between circle and ceiling.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_blocks.vision._colours import Colour, ColourCalibration
from quadvis_blocks.vision._square import Blob

Pixels = NDArray[np.uint8]

SMALLEST = 32  # px: a picture with a shorter edge holds no target
COLUMNS = 24  # width of the reduced picture that the ceiling is taken from
WINDOW = 11  # edge of its median filter: nearly half the picture, so that circles stay a minority
STEP = (0.2, 0.8)  # the soft step, as parts of the contrast between ceiling (0) and circle (1)
MARGIN = 2.0  # px of ceiling around a circle, and a tenth of its radius for its ellipse
EDGE = 1.0  # px, half the width of a circle's edge
PASSES = 4
CONTRAST_MIN = 10.0  # grey levels between circle and ceiling, as a distance of colours
COLOUR_MAX = 1.0  # largest distance of a colour from the nearest of the four
ELONGATION_MAX = 1.3  # moment of inertia over that of a disc with the same area
BOX_MAX = 2.2  # longer edge of a blob's bounding box over the shorter one
BLOBS_MAX = 20  # of one colour
FILL = (0.55, 1.25)  # area of a blob over that of the ellipse in its bounding box


@dataclass(frozen=True, eq=False)
class Target:
    """What is looked for: circles by their `colours`, radii between two limits in px.

    `ratio` is a circle's radius over the square's side.
    """

    colours: ColourCalibration
    ratio: float
    radius_min: float
    radius_max: float


class Disc(NamedTuple):
    """A measured circle: `centre` u + iv and `radius` in px, `ratio` its colour over the ceiling's."""

    centre: complex
    radius: float
    ratio: Colour


class Ceiling:
    """The ceiling's colour all over one picture: the median of the surroundings, in a reduced copy."""

    def __init__(self, pixels: Pixels, width: int) -> None:
        """Take it from `pixels`; positions will be those of a picture `width` px wide."""
        import cv2

        height, columns = pixels.shape[:2]
        rows = max(1, round(COLUMNS * height / columns))
        reduced = cv2.resize(pixels, (COLUMNS, rows), interpolation=cv2.INTER_NEAREST)
        self.picture: Any = cv2.medianBlur(reduced, WINDOW)
        self._scale = COLUMNS / width
        self._last = (COLUMNS - 1, rows - 1)

    def at(self, place: complex) -> Colour:
        """Return the ceiling's colour (blue, green, red) around a place in px."""
        x = min(max(int(place.real * self._scale), 0), self._last[0])
        y = min(max(int(place.imag * self._scale), 0), self._last[1])
        blue, green, red = self.picture[y, x].tolist()
        return blue, green, red


def find_blobs(pixels: Pixels, target: Target) -> tuple[Ceiling, list[list[Blob]]]:
    """Return the ceiling and, by corner, all that may be a circle, from a search at half resolution."""
    import cv2

    # An odd last row or column is left out, so that half a picture is exactly that.
    size = (pixels.shape[1] // 2, pixels.shape[0] // 2)
    half: Any = cv2.resize(pixels[: 2 * size[1], : 2 * size[0]], size, interpolation=cv2.INTER_AREA)
    ceiling = Ceiling(half, 2 * size[0])
    limit = cv2.resize(cv2.convertScaleAbs(ceiling.picture, alpha=target.colours.threshold), size)
    mask = cv2.cvtColor(cv2.compare(half, limit, cv2.CMP_LT), cv2.COLOR_BGR2GRAY)
    contours, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)
    blobs: list[list[Blob]] = [[], [], [], []]
    for contour in contours:
        shape = _shape(contour, target)
        if shape is None:
            continue
        x, y, radius = shape
        centre = complex(2 * x + 0.5, 2 * y + 0.5)
        ratio = _ratio(_mean(half, x, y, radius / 2), ceiling.at(centre))
        corner, distance = target.colours.nearest(ratio)
        if distance < COLOUR_MAX:
            blobs[corner].append(Blob(centre, 2 * radius, distance))
    # The time to arrange them grows with the fourth power of their number: the best colours must do.
    return ceiling, [sorted(some, key=lambda blob: blob.distance)[:BLOBS_MAX] for some in blobs]


def locate(pixels: Pixels, ceiling: Ceiling, centre: complex, radius: float) -> Disc | None:
    """Return the circle near `centre`, measured in a window that holds it whole; None if there is none.

    A window that cuts a circle displaces it, so the window follows until it does not.
    """
    for _ in range(PASSES):
        margin = MARGIN + radius / 10
        disc = measure(pixels, ceiling, centre, radius, margin)
        if disc is None or abs(disc.centre - centre) + disc.radius + EDGE <= radius + margin:
            return disc
        centre, radius = disc.centre, max(disc.radius, radius)
    return None


def measure(
    pixels: Pixels,
    ceiling: Ceiling,
    centre: complex,
    radius: float,
    margin: float,
    colour: Colour | None = None,
) -> Disc | None:
    """Return what is round in the window around `centre`, at full resolution; None if it is cut or not round.

    The window reaches `margin` px beyond the expected `radius`. `colour` is that of the circle (blue,
    green, red); if it is not given, it is the mean around `centre`.
    """
    import cv2

    height, width = pixels.shape[:2]
    reach = radius + margin
    left, right = max(0, math.ceil(centre.real - reach)), min(width, math.floor(centre.real + reach) + 1)
    top, bottom = max(0, math.ceil(centre.imag - reach)), min(height, math.floor(centre.imag + reach) + 1)
    if right - left < 2 or bottom - top < 2:
        return None
    light = ceiling.at(centre)
    dark = colour or _mean(pixels, centre.real, centre.imag, radius / 2)
    step = _soft_step(light, dark)
    if step is None:
        return None
    weights = cv2.transform(pixels[top:bottom, left:right], step)
    if left and top and right < width and bottom < height:
        # What stands in a corner of the window is no part of the circle.
        weights = cv2.bitwise_and(weights, _round_window(right - left, bottom - top))
    round_one = _round(cv2.moments(weights))
    if round_one is None:
        return None
    found, size = round_one[0] + complex(left, top), round_one[1]
    # The picture ends half a pixel beyond the centres of its outermost pixels.
    if min(found.real, found.imag, width - 1 - found.real, height - 1 - found.imag) < size - 0.5:
        return None
    return Disc(found, size, _ratio(dark, light))


@lru_cache(256)
def _round_window(width: int, height: int) -> Pixels:
    """Return a mask (height, width), 255 in the ellipse that it holds and 0 outside."""
    v, u = np.mgrid[:height, :width]
    inside = ((2 * u + 1) / width - 1) ** 2 + ((2 * v + 1) / height - 1) ** 2 <= 1
    return np.where(inside, 255, 0).astype(np.uint8)


def _round(moments: Any) -> tuple[complex, float] | None:
    """Return centre and radius (px) from the moments of weights 0..255; None if they are not of a disc."""
    area = moments["m00"] / 255
    inertia = (moments["mu20"] + moments["mu02"]) / 255
    if not area > 1 or inertia * 2 * math.pi > ELONGATION_MAX * area * area:
        return None
    centre = complex(moments["m10"] / moments["m00"], moments["m01"] / moments["m00"])
    return centre, math.sqrt(area / math.pi)


def _shape(contour: Any, target: Target) -> tuple[float, float, float] | None:
    """Return centre and radius (half-resolution px) of a blob, or None if no circle looks like that."""
    import cv2

    left, top, width, height = cv2.boundingRect(contour)
    radius = (width + height) / 4
    if not target.radius_min <= 2 * radius <= target.radius_max:
        return None
    if max(width, height) > BOX_MAX * min(width, height):
        return None
    # The outline runs through pixel centres, half a pixel inside the blob. OpenCV gives holes a positive
    # area.
    area = math.pi * radius - cv2.contourArea(contour, True)
    if not FILL[0] < area / (math.pi / 4 * width * height) < FILL[1]:
        return None
    return left + (width - 1) / 2, top + (height - 1) / 2, radius


def _soft_step(light: Colour, dark: Colour) -> NDArray[np.float32] | None:
    """Return the affine map from a pixel to its weight 0..255; None if circle and ceiling do not differ."""
    contrast = [a - b for a, b in zip(light, dark, strict=True)]
    square = sum(c * c for c in contrast)
    if square < CONTRAST_MIN * CONTRAST_MIN:
        return None
    gain = 255 / (STEP[1] - STEP[0])
    offset = gain * (sum(c * a for c, a in zip(contrast, light, strict=True)) / square - STEP[0])
    return np.array([[*(-gain * c / square for c in contrast), offset]], np.float32)


def _mean(pixels: Pixels, x: float, y: float, reach: float) -> Colour:
    """Return the mean colour of the pixels whose centres lie in the square that reaches that far."""
    import cv2

    x, y = min(max(x, 0), pixels.shape[1] - 1), min(max(y, 0), pixels.shape[0] - 1)
    reach = max(reach, 0.5)
    left, right = max(0, math.ceil(x - reach)), math.floor(x + reach) + 1
    top, bottom = max(0, math.ceil(y - reach)), math.floor(y + reach) + 1
    blue, green, red, _ = cv2.mean(pixels[top:bottom, left:right])
    return blue, green, red


def _ratio(dark: Colour, light: Colour) -> Colour:
    blue, green, red = (a / max(b, 1.0) for a, b in zip(dark, light, strict=True))
    return blue, green, red
