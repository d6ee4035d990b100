"""Coloured circles in a picture: what is looked for, the ceiling's colour, and exact measurement.

A circle is recognised by the ratio of its colour to that of the ceiling around it. Neither exposure, white
balance nor vignetting changes this ratio. The ellipse is measured by its edge at full resolution; see `rays`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.detection.colours import Colour, ColourCalibration
from quadvis_vision.detection.measure import located, remeasured

Pixels = NDArray[np.uint8]

SMALLEST = 32  # px: a picture with a shorter edge holds no target
COLUMNS = 16  # width of the reduced picture from which the ceiling's colour is taken
WINDOW = 7  # edge of its median filter: nearly half the picture, so that circles stay a minority


@dataclass(frozen=True, eq=False)
class CircleTarget:
    """The target of a search: circles by their `colours`, with radii between two limits in px.

    `ratio` is a circle's radius over the square's side.
    """

    colours: ColourCalibration
    ratio: float
    radius_min: float
    radius_max: float


class Disc(NamedTuple):
    """A measured circle: `centre` u + iv and `radius` in px, `ratio` its colour over that around it.

    `bend` describes its ellipse with half axes a and b, a the longer one at the angle w: (a^2 - b^2) exp(2 i
    w) / (a^2 + b^2), 0 for a circle. `symmetry` is 1 for a whole disc and below 0.9 for a disc that is partly
    hidden. `width` in px is the standard deviation of the edges' blur, `sigma` that of each coordinate of the
    centre.
    """

    centre: complex
    radius: float
    ratio: Colour
    bend: complex
    symmetry: float
    width: float
    sigma: float


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

    def at(self, place: complex) -> Colour:
        """Return the ceiling's colour (blue, green, red) around a place in px."""
        x = _within(place.real * self._scale, self._last[0])
        y = _within(place.imag * self._scale, self._last[1])
        blue, green, red = self.picture[int(y), int(x)].tolist()
        return blue, green, red


def locate(pixels: Pixels, guesses: Sequence[tuple[complex, float]]) -> list[Disc | None]:
    """Return the circle near each guess of a centre (px) and a radius (px); None where none is.

    A guess may be wrong by half the radius.
    """
    if not guesses:
        return []
    table = np.array([(centre.real, centre.imag, radius) for centre, radius in guesses])
    return discs(located(pixels, table))


def refine(pixels: Pixels, guesses: Sequence[Disc], shapes: Any) -> list[Disc | None]:
    """Return circles measured once more, with the `shapes` (n, 2, 2) in px that a target gives them."""
    centres = np.array([(disc.centre.real, disc.centre.imag) for disc in guesses])
    return discs(remeasured(pixels, centres, shapes, guesses[0].width))


def discs(rows: Any) -> list[Disc | None]:
    """Return the circles of rows (n, COLUMNS); None for one that is not there."""
    return [
        Disc(complex(u, v), radius, (blue, green, red), complex(real, imaginary), whole, width, sigma)
        if there
        else None
        for there, u, v, radius, blue, green, red, real, imaginary, whole, width, sigma in rows.tolist()
    ]


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
