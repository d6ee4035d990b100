"""From a picture to four circles: search the whole picture.

A search takes the best square of four circles. Without a square it takes three or two circles that cannot be
anything else; see `partial`. Once the circles are known they are followed; see `follow`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.detection.blobs import looks
from quadvis_vision.detection.circles import SMALLEST, Ceiling, CircleTarget, Disc, Pixels, locate, refine
from quadvis_vision.detection.colours import Colour
from quadvis_vision.detection.partial import Known, three_of_four, two_of_four, whole
from quadvis_vision.detection.square import (
    Blob,
    arrangements,
    expected_bends,
    expected_radii,
    expected_shapes,
    square_cost,
)

Array = NDArray[np.float64]

FOUR_CIRCLES, THREE_CIRCLES, TWO_CIRCLES, NOT_FOUND, INCONSISTENT = range(5)
STALE, UNCALIBRATED, UNUSABLE, TOO_LARGE = range(5, 9)
"""Status: four, three or two circles seen; no target; four circles that are no square; no picture yet; no
calibration; a picture that is empty, too small, of another size or not uint8 blue-green-red; a square of
circles that are larger than is allowed."""

QUALITY_MIN = 0.9  # of the symmetry, and of the second largest size: a circle that lost a fifth of its area
SIZES_MAX = math.log(1.15)  # of whole circles of a new target against their median
BENDS_MAX = (0.12, 1.0)  # of a circle's ellipse against that of the square: the second is px of radius
CHOICES = 6  # squares that are measured at full resolution
NEAR = 0.45  # largest distance of a colour from that of its circle where only two circles are seen
FEW = 8  # circles of one colour that are measured at full resolution where no four form a square


class Detection(NamedTuple):
    """The target in a picture, by corner 1..4.

    `centres` (4, 2) are in px, with NaN rows for missing circles; `quality` (4,) is that of the block, NaN
    for missing circles; `sigma` (4,) is the standard deviation of u and of v in px, NaN for a circle that has
    no centre; `status` is one of the constants above. `places` (4, 6) serve to follow all four
    circles, missing ones too: u, v and expected radius in px, colour divided by the ceiling's (blue, green,
    red).
    """

    centres: Array
    quality: Array
    sigma: Array
    status: int
    places: Array


class CirclePlace(NamedTuple):
    """The expected place of a circle: `centre` u + iv and `radius` in px, `ratio` its colour."""

    centre: complex
    radius: float
    ratio: Colour


def usable(pixels: object, size: tuple[int, int] | None = None) -> bool:
    """Return whether this is a picture that can be searched and, if `size` is given, has that size (px)."""
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8 or pixels.ndim != 3:
        return False
    height, width, channels = pixels.shape
    if size is not None and (width, height) != size:
        return False
    return bool(channels == 3 and min(height, width) >= SMALLEST)


def nothing(status: int) -> Detection:
    """Return the detection of no circle."""
    return Detection(
        np.full((4, 2), np.nan), np.full(4, np.nan), np.full(4, np.nan), status, np.zeros((4, 6))
    )


def search(pixels: Pixels, target: CircleTarget, fewest: int = 2, thorough: bool = True) -> Detection:
    """Search the whole picture for the circles; fewer than `fewest` are no target.

    Without `thorough` there is one look only, which is enough on a plain ceiling.
    """
    ceiling = Ceiling(pixels)
    status = NOT_FOUND
    blobs: Sequence[Sequence[Blob]] = ()
    measured: dict[Blob, Disc | None] = {}
    for blobs in looks(pixels, ceiling, target):
        if all(blobs):
            status = INCONSISTENT
            found = _four(pixels, target, arrangements(blobs, target.ratio, CHOICES), measured)
            if found is not None:
                return found
        if not thorough:
            break
    if fewest < 4 and sum(map(bool, blobs)) >= fewest:
        found = _few(pixels, target, blobs, fewest, measured)
        if found is not None:
            return found
    return nothing(TOO_LARGE if thorough and _larger(pixels, ceiling, target) else status)


def _larger(pixels: Pixels, ceiling: Ceiling, target: CircleTarget) -> bool:
    """Return whether a target with circles that are too large is in the picture."""
    larger = replace(target, radius_min=target.radius_max, radius_max=max(pixels.shape) / 2)
    blobs = next(looks(pixels, ceiling, larger))
    return all(blobs) and _four(pixels, larger, arrangements(blobs, target.ratio, CHOICES), {}) is not None


def _measure(pixels: Pixels, blobs: Sequence[Blob], measured: dict[Blob, Disc | None]) -> None:
    """Measure blobs at full resolution, unless that was done before."""
    new = [blob for blob in dict.fromkeys(blobs) if blob not in measured]
    discs = locate(pixels, [(blob.centre, blob.radius) for blob in new])
    measured.update(zip(new, discs, strict=True))


def _four(
    pixels: Pixels,
    target: CircleTarget,
    choices: Sequence[Sequence[Blob]],
    measured: dict[Blob, Disc | None],
) -> Detection | None:
    """Return the best of some squares after measuring them at full resolution, or None."""
    _measure(pixels, [blob for corners in choices for blob in corners], measured)
    best, least = None, math.inf
    for corners in choices:
        known = [disc for blob in corners if (disc := measured[blob]) is not None]
        if len(known) == 4:
            cost = _square_cost(known, target)
            if cost < least:
                best, least = known, cost
    return None if best is None else refined(pixels, best, target)


def _square_cost(known: Sequence[Disc], target: CircleTarget) -> float:
    """Return the misfit of four measured circles to a new target; infinity if they are none."""
    radii, cost = _fit(known, target)
    if cost == math.inf:
        return cost
    sizes = sorted(math.log(disc.radius / radius) for disc, radius in zip(known, radii, strict=True))
    shapes = expected_shapes([disc.centre for disc in known], target.ratio)
    if shapes is None:
        return math.inf
    whole = 0
    for corner, (disc, bend) in enumerate(zip(known, expected_bends(shapes), strict=True)):
        fits = abs(disc.bend - bend) < BENDS_MAX[0] + BENDS_MAX[1] / disc.radius
        whole += fits and disc.symmetry >= QUALITY_MIN and target.colours.nearest(disc.ratio)[0] == corner
    # One of the four may be partly hidden, or deformed by a line beside it.
    return cost if whole >= 3 and sizes[3] - sizes[1] <= SIZES_MAX else math.inf


def refined(pixels: Pixels, known: Sequence[Disc], target: CircleTarget) -> Detection | None:
    """Return the detection of a square of circles, each measured as the ellipse that the square makes it."""
    radii, cost = _fit(known, target)
    shapes = expected_shapes([disc.centre for disc in known], target.ratio)
    if cost == math.inf or shapes is None:
        return None
    scale = sorted(disc.radius / radius for disc, radius in zip(known, radii, strict=True))
    seen = refine(pixels, known, shapes * ((scale[1] + scale[2]) / 2))
    discs = [
        disc if disc is not None and target.colours.nearest(disc.ratio)[0] == corner else None
        for corner, disc in enumerate(seen)
    ]
    found = [disc for disc in discs if disc is not None]
    if len(found) == 4:
        return square_seen(found, target)
    return detection(discs, _places(known, radii))


def _few(
    pixels: Pixels,
    target: CircleTarget,
    blobs: Sequence[Sequence[Blob]],
    fewest: int,
    measured: dict[Blob, Disc | None],
) -> Detection | None:
    """Return three or two circles that can only be those of the target, or None."""
    _measure(pixels, [blob for some in blobs for blob in some[:FEW]], measured)
    discs: list[list[Disc]] = [[], [], [], []]
    alike: list[list[Disc]] = [[], [], [], []]
    for corner in range(4):
        for blob in blobs[corner][:FEW]:
            disc = measured[blob]
            if disc is None or disc.symmetry < QUALITY_MIN:
                continue
            nearest, distance = target.colours.nearest(disc.ratio)
            if nearest == corner and not any(abs(disc.centre - o.centre) < o.radius for o in discs[corner]):
                discs[corner].append(disc)
                if distance < NEAR:
                    alike[corner].append(disc)
    found = three_of_four(discs, target.ratio)
    if len(found) > 1 and all(len(some) <= 1 for some in discs):
        # One of four circles is partly hidden, though not so much that it shows by itself.
        found = [max(found, key=lambda known: min(disc.symmetry for disc in known.values()))]
    # Where there are more round things of about these colours, two of them may fit by chance.
    if not found and fewest < 3 and sum(map(len, alike)) == sum(map(len, discs)) == 2:
        found = two_of_four(alike, target.ratio)
    return _known(found[0], target) if len(found) == 1 else None


def _known(known: Known, target: CircleTarget) -> Detection | None:
    """Return the detection of three or two circles."""
    radius = sum(disc.radius for disc in known.values()) / len(known)
    places = [
        CirclePlace(known[k].centre, known[k].radius, known[k].ratio)
        if k in known
        else CirclePlace(centre, radius, target.colours.ratios[k])
        for k, centre in enumerate(whole(known))
    ]
    return detection([known.get(k) for k in range(4)], places)


def square_seen(known: Sequence[Disc], target: CircleTarget) -> Detection | None:
    """Return the detection of four circles that form a square, or None."""
    radii, cost = _fit(known, target)
    return None if cost == math.inf else detection(known, _places(known, radii))


def _fit(discs: Sequence[Disc], target: CircleTarget) -> tuple[Sequence[float], float]:
    """Return the expected radii (px) of four circles, and their misfit to a square: infinity if none."""
    points = [disc.centre for disc in discs]
    radii = expected_radii(points, target.ratio)
    if radii is None:
        return (), math.inf
    return radii, square_cost(points, [disc.radius for disc in discs], radii)


def _places(discs: Sequence[Disc], radii: Sequence[float]) -> list[CirclePlace]:
    return [CirclePlace(disc.centre, radius, disc.ratio) for disc, radius in zip(discs, radii, strict=True)]


def detection(discs: Sequence[Disc | None], places: Sequence[CirclePlace]) -> Detection | None:
    """Return the detection without partly hidden circles; None if fewer than two circles are left."""
    sizes = [
        math.nan if disc is None else disc.radius / place.radius
        for disc, place in zip(discs, places, strict=True)
    ]
    order = sorted(part for part in sizes if part == part)
    if not order:
        return None
    # Of two circles one edge may have cut both, so that only the distance between them tells their size.
    limit = QUALITY_MIN * (order[-2] if len(order) > 2 else 1.0)
    quality = [
        math.nan if disc is None else min(size, disc.symmetry)
        for disc, size in zip(discs, sizes, strict=True)
    ]
    hidden = [
        corner
        for corner, (disc, size) in enumerate(zip(discs, sizes, strict=True))
        if disc is None or size < limit or disc.symmetry < QUALITY_MIN
    ]
    if len(hidden) > 2:
        return None
    table = np.array([(p.centre.real, p.centre.imag, p.radius, *p.ratio) for p in places])
    centres = table[:, :2].copy()
    sigma = np.array([math.nan if disc is None else disc.sigma for disc in discs])
    if hidden:
        centres[hidden] = math.nan
        sigma[hidden] = math.nan
    return Detection(centres, np.array(quality), sigma, len(hidden), table)
