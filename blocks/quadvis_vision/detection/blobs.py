"""Find everything that may be a circle: compact patches darker than the ceiling, at reduced resolution.

On a plain ceiling one threshold finds them. Lines that touch a circle join its patch, so further looks
follow: with lower thresholds, at which a lighter line vanishes; with narrow dark lines closed by morphology;
and with the brightest surroundings in place of the ceiling, for circles on white paper.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from quadvis_vision.detection.circles import Ceiling, CircleTarget, Pixels, mean, over
from quadvis_vision.detection.colours import Colour
from quadvis_vision.detection.square import Blob

COLOUR_MAX = 1.0  # largest distance of a colour from the nearest of the four
BOX_MAX = 2.2  # longer edge of a patch's bounding box over the shorter one
FILL = (0.55, 1.25)  # area of a patch over that of the ellipse in its bounding box
TINY = 1.5  # px of the reduced picture: a smaller patch has no shape
WIDE = 480  # px: a wider picture is first searched at a quarter of its size
PATCHES_MAX = 350  # patches that are examined, those with the longest outlines; their number takes time
OUTLINES_MAX = 1500  # of all looks at a picture: noise has more, the worst of real ceilings less than half
BLOBS_MAX = 20  # blobs of one colour; the time to arrange blobs grows with the fourth power of their number
LOWER = (0.72, 0.52, 0.38)  # of the threshold, one after the other
CLOSED = (3, 5)  # px: narrower dark lines are closed; circles of this size remain
CLOSED_LOWER = (1.0, 0.6)  # of the threshold, after closing
BRIGHT = 12  # part of the picture's width around a place in which the brightest is taken for the ceiling
ROUGH = 0.6  # px of the reduced picture: error of a patch's radius
SAME = 0.5  # of a radius: patches nearer to each other show the same thing

_FULL = 200  # stands for a pixel as bright as the ceiling

Patch = tuple[complex, float, Colour]  # centre u + iv and radius in px, colour over the ceiling's
Blobs = list[list[Blob]]
Limits = tuple[float, float]  # radii in px


def reductions(pixels: Pixels) -> tuple[int, ...]:
    """Return the factors by which a picture is reduced for its searches, in their order."""
    return (4, 2) if pixels.shape[1] > WIDE else (2,)


def looks(pixels: Pixels, ceiling: Ceiling, target: CircleTarget) -> Iterator[Blobs]:
    """Yield, look after look, all blobs found so far: for each corner those of its colour, the best first."""
    blobs: Blobs = [[], [], [], []]
    views = [ReducedPicture(pixels, ceiling, reduction) for reduction in reductions(pixels)]
    threshold, limits = target.colours.threshold, (target.radius_min, target.radius_max)
    for view in views:
        _add(blobs, view.plain(threshold, limits), target)
        yield blobs
    for view in views:
        for masks in (view.lower, view.closed, view.bright):
            for patches in masks(threshold, limits):
                _add(blobs, patches, target)
                if sum(view.outlines for view in views) > OUTLINES_MAX:
                    yield blobs
                    return
            yield blobs


def _add(blobs: Blobs, patches: list[Patch], target: CircleTarget) -> None:
    """Add patches in a colour of the target's to the blobs of that colour."""
    for centre, radius, ratio in patches:
        corner, distance = target.colours.nearest(ratio)
        if distance < COLOUR_MAX:
            others = blobs[corner]
            known = [o for o in others if abs(o.centre - centre) < SAME * min(radius, o.radius)]
            if all(distance < other.distance for other in known):
                others[:] = [other for other in others if other not in known]
                others.append(Blob(centre, radius, distance))
    for some in blobs:
        some.sort(key=lambda blob: blob.distance)
        del some[BLOBS_MAX:]


class ReducedPicture:
    """A reduced picture over its ceiling."""

    def __init__(self, pixels: Pixels, ceiling: Ceiling, reduction: int) -> None:
        import cv2

        self._reduction = reduction
        # Odd last rows and columns are left out, so that every reduced pixel stands for whole pixels.
        self._size = (pixels.shape[1] // reduction, pixels.shape[0] // reduction)
        # For a quarter of the size the mean of the four middle pixels of sixteen is enough.
        method = cv2.INTER_AREA if reduction == 2 else cv2.INTER_LINEAR
        whole = pixels[: reduction * self._size[1], : reduction * self._size[0]]
        self._small: Any = cv2.resize(whole, self._size, interpolation=method)
        self._ceiling: Any = cv2.resize(ceiling.picture, self._size)
        self._dark = self._over(self._ceiling)
        self.outlines = 0  # in all looks so far

    def _over(self, light: Any) -> Any:
        """Return the darkest channel of each pixel over a light."""
        import cv2

        blue, green, red = cv2.split(cv2.divide(self._small, light, scale=_FULL))
        return cv2.min(cv2.min(blue, green), red)

    def lower(self, threshold: float, limits: Limits) -> Iterator[list[Patch]]:
        """Yield the patches below lower thresholds."""
        for part in LOWER:
            yield self.plain(part * threshold, limits)

    def closed(self, threshold: float, limits: Limits) -> Iterator[list[Patch]]:
        """Yield the patches that remain when narrow dark lines are closed."""
        import cv2

        for edge in CLOSED:
            disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (edge, edge))
            dark = cv2.morphologyEx(self._dark, cv2.MORPH_CLOSE, disc)
            for part in CLOSED_LOWER:
                yield self._patches(dark, part * threshold, limits, self._ceiling)

    def bright(self, threshold: float, limits: Limits) -> Iterator[list[Patch]]:
        """Yield the patches that are darker than the brightest surroundings."""
        import cv2

        edge = self._size[0] // BRIGHT | 1
        light = cv2.dilate(
            cv2.blur(self._small, (3, 3)), cv2.getStructuringElement(cv2.MORPH_RECT, (edge, edge))
        )
        dark = self._over(light)
        for part in CLOSED_LOWER:
            yield self._patches(dark, part * threshold, limits, light)

    def plain(self, threshold: float, limits: Limits) -> list[Patch]:
        """Return patches with a radius within `limits` (px), darker than `threshold` times the ceiling."""
        return self._patches(self._dark, threshold, limits, self._ceiling)

    def _patches(self, dark: Any, threshold: float, limits: Limits, light: Any) -> list[Patch]:
        import cv2

        mask = cv2.threshold(dark, threshold * _FULL, 255, cv2.THRESH_BINARY_INV)[1]
        outlines = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_SIMPLE)[0]
        self.outlines += len(outlines)
        if len(outlines) > PATCHES_MAX:
            outlines = sorted(outlines, key=len)[-PATCHES_MAX:]
        scale, middle = self._reduction, (self._reduction - 1) / 2
        found = []
        for outline in outlines:
            shape = _shape(outline, limits[0] / scale - ROUGH, limits[1] / scale + ROUGH)
            if shape is not None:
                x, y, radius = shape
                colour = over(mean(self._small, x, y, radius / 2), tuple(light[int(y), int(x)].tolist()))
                found.append((complex(scale * x + middle, scale * y + middle), scale * radius, colour))
        return found


def _shape(contour: Any, low: float, high: float) -> tuple[float, float, float] | None:
    """Return the centre and radius (px) of a patch, or None if the patch cannot be a circle."""
    import cv2

    left, top, width, height = cv2.boundingRect(contour)
    radius = (width + height) / 4
    if not low <= radius <= high or width > BOX_MAX * height or height > BOX_MAX * width:
        return None
    inner = -cv2.contourArea(contour, True)
    if inner < 0:  # a hole: OpenCV gives it a positive area
        return None
    # The outline runs through pixel centres, half a pixel inside the patch.
    fill = (math.pi * radius + inner) / (math.pi / 4 * width * height)
    if not FILL[0] < fill < (FILL[1] if radius > TINY else math.inf):
        return None
    return left + (width - 1) / 2, top + (height - 1) / 2, radius
