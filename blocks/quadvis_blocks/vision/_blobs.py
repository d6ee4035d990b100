"""All that may be a circle in a picture: compact patches darker than the ceiling, at reduced resolution."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, NamedTuple

from quadvis_blocks.vision._circles import Ceiling, Pixels, Target, mean, over
from quadvis_blocks.vision._colours import Colour
from quadvis_blocks.vision._square import Blob

COLOUR_MAX = 1.0  # largest distance of a colour from the nearest of the four
BOX_MAX = 2.2  # longer edge of a patch's bounding box over the shorter one
FILL = (0.55, 1.25)  # area of a patch over that of the ellipse in its bounding box
WIDE = 480  # px: a picture that is wider is first searched at a quarter of its size
PATCHES_MAX = 500  # those with the longest outlines; the time to look at them grows with their number
BLOBS_MAX = 20  # of one colour; the time to arrange them grows with the fourth power of their number


class Patch(NamedTuple):
    """A compact patch: `centre` u + iv and `radius` in px, `ratio` its colour over the ceiling's."""

    centre: complex
    radius: float
    ratio: Colour


def reductions(pixels: Pixels) -> tuple[int, ...]:
    """Return by which factors to reduce a picture to search it, one after the other."""
    return (4, 2) if pixels.shape[1] > WIDE else (2,)


def find_blobs(pixels: Pixels, ceiling: Ceiling, target: Target, reduction: int) -> list[list[Blob]]:
    """Return, by corner, what has the colour of its circle, those of the best colour first."""
    blobs: list[list[Blob]] = [[], [], [], []]
    limits = (target.radius_min, target.radius_max)
    for patch in find_patches(pixels, ceiling, target.colours.threshold, limits, reduction):
        corner, distance = target.colours.nearest(patch.ratio)
        if distance < COLOUR_MAX:
            blobs[corner].append(Blob(patch.centre, patch.radius, distance))
    return [sorted(some, key=lambda blob: blob.distance)[:BLOBS_MAX] for some in blobs]


def find_patches(
    pixels: Pixels, ceiling: Ceiling, threshold: float, limits: tuple[float, float], reduction: int
) -> Iterator[Patch]:
    """Yield what has a radius within `limits` px and a channel below `threshold` times the ceiling."""
    import cv2

    # Odd last rows and columns are left out, so that a reduced picture is exactly that.
    size = (pixels.shape[1] // reduction, pixels.shape[0] // reduction)
    # A quarter of the size needs no more than the mean of the four pixels in the middle of sixteen.
    method = cv2.INTER_AREA if reduction == 2 else cv2.INTER_LINEAR
    whole = pixels[: reduction * size[1], : reduction * size[0]]
    small: Any = cv2.resize(whole, size, interpolation=method)
    limit = cv2.resize(cv2.convertScaleAbs(ceiling.picture, alpha=threshold), size)
    mask = cv2.cvtColor(cv2.compare(small, limit, cv2.CMP_LT), cv2.COLOR_BGR2GRAY)
    contours: Any = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)[0]
    if len(contours) > PATCHES_MAX:
        contours = sorted(contours, key=len)[-PATCHES_MAX:]
    low, high = limits[0] / reduction, limits[1] / reduction
    middle = (reduction - 1) / 2
    for contour in contours:
        shape = _shape(contour, low, high)
        if shape is None:
            continue
        x, y, radius = shape
        centre = complex(reduction * x + middle, reduction * y + middle)
        yield Patch(centre, reduction * radius, over(mean(small, x, y, radius / 2), ceiling.at(centre)))


def _shape(contour: Any, low: float, high: float) -> tuple[float, float, float] | None:
    """Return centre and radius (px) of a patch, or None if no circle looks like that."""
    import cv2

    left, top, width, height = cv2.boundingRect(contour)
    radius = (width + height) / 4
    if not low <= radius <= high or max(width, height) > BOX_MAX * min(width, height):
        return None
    # The outline runs through pixel centres, half a pixel inside the patch. OpenCV gives holes a positive
    # area.
    area = math.pi * radius - cv2.contourArea(contour, True)
    if not FILL[0] < area / (math.pi / 4 * width * height) < FILL[1]:
        return None
    return left + (width - 1) / 2, top + (height - 1) / 2, radius
