"""Find everything that may be a circle: compact patches darker than the ceiling, at reduced resolution."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from quadvis_vision.detection.circles import Ceiling, Pixels, Target, mean, over
from quadvis_vision.detection.colours import Colour
from quadvis_vision.detection.square import Blob

COLOUR_MAX = 1.0  # largest distance of a colour from the nearest of the four
BOX_MAX = 2.2  # longer edge of a patch's bounding box over the shorter one
FILL = (0.55, 1.25)  # area of a patch over that of the ellipse in its bounding box
WIDE = 480  # px: a wider picture is first searched at a quarter of its size
PATCHES_MAX = 500  # patches that are examined, those with the longest outlines; their number takes time
BLOBS_MAX = 20  # blobs of one colour; the time to arrange blobs grows with the fourth power of their number

Patch = tuple[complex, float, Colour]  # centre u + iv and radius in px, colour over the ceiling's


def reductions(pixels: Pixels) -> tuple[int, ...]:
    """Return the factors by which a picture is reduced for its searches, in their order."""
    return (4, 2) if pixels.shape[1] > WIDE else (2,)


def find_blobs(
    pixels: Pixels, ceiling: Ceiling, target: Target, reduction: int
) -> tuple[list[list[Blob]], bool]:
    """Return, for each corner, the blobs with the colour of its circle, the best colour first.

    The second value is true if the picture is so crowded that only a part of it was searched.
    """
    blobs: list[list[Blob]] = [[], [], [], []]
    limits = (target.radius_min, target.radius_max)
    patches, crowded = find_patches(pixels, ceiling, target.colours.threshold, limits, reduction)
    for centre, radius, ratio in patches:
        corner, distance = target.colours.nearest(ratio)
        if distance < COLOUR_MAX:
            blobs[corner].append(Blob(centre, radius, distance))
    return [sorted(some, key=lambda blob: blob.distance)[:BLOBS_MAX] for some in blobs], crowded


def find_patches(
    pixels: Pixels, ceiling: Ceiling, threshold: float, limits: tuple[float, float], reduction: int
) -> tuple[list[Patch], bool]:
    """Return patches with a radius within `limits` (px) and a channel below `threshold` times the ceiling.

    The second value is that of `find_blobs`.
    """
    small, outlines = _outlines(pixels, ceiling, threshold, reduction)
    crowded = len(outlines) > PATCHES_MAX
    if crowded:
        outlines = sorted(outlines, key=len)[-PATCHES_MAX:]
    low, high, middle = limits[0] / reduction, limits[1] / reduction, (reduction - 1) / 2
    patches = []
    for outline in outlines:
        shape = _shape(outline, low, high)
        if shape is not None:
            x, y, radius = shape
            centre = complex(reduction * x + middle, reduction * y + middle)
            ratio = over(mean(small, x, y, radius / 2), ceiling.at(centre))
            patches.append((centre, reduction * radius, ratio))
    return patches, crowded


def _outlines(
    pixels: Pixels, ceiling: Ceiling, threshold: float, reduction: int
) -> tuple[Pixels, Sequence[Any]]:
    """Return the reduced picture, and the outlines of all patches in it that are darker than the ceiling."""
    import cv2

    # Odd last rows and columns are left out, so that every reduced pixel stands for whole pixels.
    size = (pixels.shape[1] // reduction, pixels.shape[0] // reduction)
    # For a quarter of the size the mean of the four middle pixels of sixteen is enough.
    method = cv2.INTER_AREA if reduction == 2 else cv2.INTER_LINEAR
    whole = pixels[: reduction * size[1], : reduction * size[0]]
    small: Any = cv2.resize(whole, size, interpolation=method)
    limit = cv2.resize(cv2.convertScaleAbs(ceiling.picture, alpha=threshold), size)
    mask = cv2.cvtColor(cv2.compare(small, limit, cv2.CMP_LT), cv2.COLOR_BGR2GRAY)
    return small, cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)[0]


def _shape(contour: Any, low: float, high: float) -> tuple[float, float, float] | None:
    """Return the centre and radius (px) of a patch, or None if the patch cannot be a circle."""
    import cv2

    left, top, width, height = cv2.boundingRect(contour)
    radius = (width + height) / 4
    if not low <= radius <= high or width > BOX_MAX * height or height > BOX_MAX * width:
        return None
    # The outline runs through pixel centres, half a pixel inside the patch. OpenCV gives holes a positive
    # area.
    area = math.pi * radius - cv2.contourArea(contour, True)
    if not FILL[0] < area / (math.pi / 4 * width * height) < FILL[1]:
        return None
    return left + (width - 1) / 2, top + (height - 1) / 2, radius
