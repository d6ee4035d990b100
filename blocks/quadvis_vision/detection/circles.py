"""Measure one coloured circle in a picture, fast and in any light.

The ceiling is the white reference: each pixel is compared with the local median of its surroundings, and a
circle is recognised by the ratio of its colour to the ceiling's. Neither exposure, white balance nor
vignetting changes this ratio. Centres are moments at full resolution, weighted by a soft step around half the
contrast between circle and ceiling.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.detection.colours import Colour, ColourCalibration

Pixels = NDArray[np.uint8]

SMALLEST = 32  # px: a picture with a shorter edge holds no target
COLUMNS = 16  # width of the reduced picture from which the ceiling's colour is taken
WINDOW = 7  # edge of its median filter: nearly half the picture, so that circles stay a minority
STEP = (0.2, 0.8)  # the soft step, as parts of the contrast between ceiling (0) and circle (1)
MARGIN = 2.0  # px of ceiling around a circle, plus a tenth of its radius, as it may be an ellipse
EDGE = 1.0  # px, half the width of a circle's edge
PASSES = 4
EVEN = 0.05  # of the light: a ceiling that varies less needs no correction
SPAN = 2  # columns of the reduced picture over which its slope is taken
RAISED = 0.1  # of the contrast: the shift of the step by which the width of a circle's edge is measured
CONTRAST_MIN = 10.0  # grey levels between circle and ceiling, as a distance of colours
INERTIA_MAX = 1.3  # moment of inertia over that of a disc with the same area

# A disc in perspective has no third moments. If a straight edge hides a tenth of the diameter, the third
# moment of threefold symmetry is 0.036 (of area times cube of the radius). Noise and blur make it at most
# 0.018; compression makes it larger where the contrast is low.
SKEW_MAX = (
    0.025,
    0.04,
    1.0,
)  # of a whole disc: the sum of 1, 1 / radius in px and 1 / contrast in grey levels

_GAIN = 255 / (STEP[1] - STEP[0])


@dataclass(frozen=True, eq=False)
class Target:
    """The target of a search: circles by their `colours`, with radii between two limits in px.

    `ratio` is a circle's radius over the square's side.
    """

    colours: ColourCalibration
    ratio: float
    radius_min: float
    radius_max: float


class Disc(NamedTuple):
    """A measured circle: `centre` u + iv and `radius` in px, `ratio` its colour over the ceiling's.

    `bend` describes its ellipse with half axes a and b, a the longer one at the angle w: (a^2 - b^2) exp(2 i
    w) / (a^2 + b^2), 0 for a circle. `symmetry` is 1 for a whole disc and below 0.9 for a disc that is partly
    hidden.
    """

    centre: complex
    radius: float
    ratio: Colour
    bend: complex
    symmetry: float


class Ceiling:
    """The ceiling's colour all over one picture: the median of the surroundings, in a reduced copy."""

    def __init__(self, pixels: Pixels) -> None:
        import cv2

        height, width = pixels.shape[:2]
        rows = max(1, round(COLUMNS * height / width))
        reduced = cv2.resize(pixels, (COLUMNS, rows), interpolation=cv2.INTER_LINEAR)
        self.picture: Any = cv2.medianBlur(reduced, WINDOW)
        self._scale = COLUMNS / width
        self._last = (COLUMNS - 1, rows - 1)
        low, high, _, _ = cv2.minMaxLoc(cv2.extractChannel(self.picture, 1))
        self.even = high - low < EVEN * high

    def at(self, place: complex) -> Colour:
        """Return the ceiling's colour (blue, green, red) around a place in px."""
        x, y = self._pixel(place)
        blue, green, red = self.picture[y, x].tolist()
        return blue, green, red

    def _pixel(self, place: complex) -> tuple[int, int]:
        x = _within(place.real * self._scale, self._last[0])
        y = _within(place.imag * self._scale, self._last[1])
        return int(x), int(y)

    def slope(self, place: complex) -> complex:
        """Return the relative growth of the light per px around a place: along u, plus i times along v."""
        x, y = self._pixel(place)
        left, right = max(x - SPAN, 0), min(x + SPAN, self._last[0])
        top, bottom = max(y - SPAN, 0), min(y + SPAN, self._last[1])
        light = max(float(self.picture[y, x].sum()), 1.0) / self._scale
        along_u = float(self.picture[y, right].sum()) - float(self.picture[y, left].sum())
        along_v = float(self.picture[bottom, x].sum()) - float(self.picture[top, x].sum())
        return complex(along_u / (light * max(right - left, 1)), along_v / (light * max(bottom - top, 1)))


def locate(
    pixels: Pixels, ceiling: Ceiling, centre: complex, radius: float, slack: float = 0.0
) -> Disc | None:
    """Return the circle near `centre`, measured in a window that holds it whole; None if none is there.

    A window that cuts a circle displaces its centre, so the window moves until it holds the whole circle. The
    first window is `slack` px larger.
    """
    for _ in range(PASSES):
        margin = MARGIN + slack + radius / 10
        disc = measure(pixels, ceiling, centre, radius, margin)
        if disc is None or abs(disc.centre - centre) + disc.radius + EDGE <= radius + margin:
            return disc
        centre, radius, slack = disc.centre, max(disc.radius, radius), 0.0
    return None


def measure(
    pixels: Pixels,
    ceiling: Ceiling,
    centre: complex,
    radius: float,
    margin: float,
    colour: Colour | None = None,
) -> Disc | None:
    """Return the round thing in the window around `centre`, at full resolution; None if cut or not round.

    The window reaches `margin` px beyond the expected `radius`. `colour` is that of the circle (blue,
    green, red); if it is not given, it is the mean around `centre`.
    """
    import cv2

    height, width = pixels.shape[:2]
    x, y, reach = centre.real, centre.imag, radius + margin
    left, right = _interval(x, reach, width)
    top, bottom = _interval(y, reach, height)
    if right - left < 2 or bottom - top < 2:
        return None
    light = ceiling.at(centre)
    dark = colour or mean(pixels, x, y, radius / 2)
    contrast = math.dist(light, dark)
    if contrast < CONTRAST_MIN:
        return None
    step = _soft_step(light, dark, contrast)
    window = pixels[top:bottom, left:right]
    # If the whole window is in the picture, a thing in one of its corners is no part of the circle.
    inside = bool(left and top and right < width and bottom < height)
    shape = _shape(cv2.moments(_weights(window, step, inside)), contrast)
    if shape is None:
        return None
    u, v, size, bend, symmetry = shape
    u, v = u + left, v + top
    if not ceiling.even:
        shift = ceiling.slope(centre) * _lag(light, dark, contrast) * size
        step[0, 3] += _GAIN * RAISED
        area = cv2.sumElems(_weights(window, step, inside))[0] / 255
        shift *= (math.sqrt(area / math.pi) - size) / RAISED
        u, v = u + shift.real, v + shift.imag
    # The picture ends half a pixel beyond the centres of its outermost pixels.
    if min(u, v, width - 1 - u, height - 1 - v) < size - 0.5:
        return None
    return Disc(complex(u, v), size, over(dark, light), bend, symmetry)


def mean(pixels: Pixels, x: float, y: float, reach: float) -> Colour:
    """Return the mean colour of the pixels with centres within -`reach` to +`reach` around (x, y)."""
    import cv2

    height, width = pixels.shape[:2]
    reach = max(reach, 0.5)
    left, right = _interval(_within(x, width - 1), reach, width)
    top, bottom = _interval(_within(y, height - 1), reach, height)
    blue, green, red, _ = cv2.mean(pixels[top:bottom, left:right])
    return blue, green, red


def _interval(middle: float, reach: float, size: int) -> tuple[int, int]:
    """Return the first pixel whose centre lies within `reach` of the middle, and the pixel after the last."""
    # This is called often, and comparisons take half the time of `min` and `max`.
    low, high = math.ceil(middle - reach), math.floor(middle + reach) + 1
    return low if low > 0 else 0, high if high < size else size


def _within(place: float, last: int) -> float:
    """Return the place limited to 0 to `last`."""
    return place if 0 <= place <= last else last if place > 0 else 0


def over(dark: Colour, light: Colour) -> Colour:
    """Return the ratio of a circle's colour to the ceiling's, channel by channel."""
    return dark[0] / max(light[0], 1.0), dark[1] / max(light[1], 1.0), dark[2] / max(light[2], 1.0)


def _weights(window: Pixels, step: NDArray[np.float32], inside: bool) -> Any:
    """Return the weights in a window, or only in the ellipse inside it."""
    import cv2

    weights = cv2.transform(window, step)
    if inside:
        weights = cv2.bitwise_and(weights, _round_window(window.shape[1], window.shape[0]))
    return weights


def _lag(light: Colour, dark: Colour, contrast: float) -> float:
    """Return the shift of a circle's edge away from half the contrast, per share of missing light.

    The shift is a part of the contrast. Both sides of the edge lose light in the same proportion, but the
    step is the one for the light in the middle.
    """
    along = sum((a - b) * a for a, b in zip(light, dark, strict=True))
    return along / (contrast * contrast) - 0.5


@lru_cache(256)
def _round_window(width: int, height: int) -> Pixels:
    """Return a mask (height, width): 255 in the largest ellipse inside it, 0 outside."""
    v, u = np.mgrid[:height, :width]
    inside = ((2 * u + 1) / width - 1) ** 2 + ((2 * v + 1) / height - 1) ** 2 <= 1
    return np.where(inside, 255, 0).astype(np.uint8)


def _shape(moments: Any, contrast: float) -> tuple[float, float, float, complex, float] | None:
    """Return centre u, v, radius (px), bend and symmetry of weights to 255; None if they are not round."""
    weight = moments["m00"]
    area = weight / 255
    inertia = moments["mu20"] + moments["mu02"]
    if not area > 1 or inertia * (2 * math.pi / 255) > INERTIA_MAX * area * area or not inertia > 0:
        return None
    radius = math.sqrt(area / math.pi)
    bend = complex(moments["mu20"] - moments["mu02"], 2 * moments["mu11"]) / inertia
    lean = math.hypot(moments["mu30"] - 3 * moments["mu12"], 3 * moments["mu21"] - moments["mu03"])
    skew = lean / (weight * radius**3) / (SKEW_MAX[0] + SKEW_MAX[1] / radius + SKEW_MAX[2] / contrast)
    return moments["m10"] / weight, moments["m01"] / weight, radius, bend, max(0.0, 1 - 0.1 * skew * skew)


def _soft_step(light: Colour, dark: Colour, contrast: float) -> NDArray[np.float32]:
    """Return the affine map from a pixel to its weight 0..255."""
    blue, green, red = light[0] - dark[0], light[1] - dark[1], light[2] - dark[2]
    gain = _GAIN / (contrast * contrast)
    offset = gain * (blue * light[0] + green * light[1] + red * light[2]) - _GAIN * STEP[0]
    return np.array([[-gain * blue, -gain * green, -gain * red, offset]], np.float32)
