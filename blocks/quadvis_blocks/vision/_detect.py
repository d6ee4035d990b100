"""From a picture to four circles: search the whole of it, or follow those of the picture before.

A search accepts four circles only, because three of one picture are easily met by chance; once they are
known, three or two that moved together keep the target.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_blocks.vision._circles import (
    SMALLEST,
    Ceiling,
    Disc,
    Pixels,
    Target,
    find_blobs,
    locate,
    measure,
)
from quadvis_blocks.vision._colours import Colour
from quadvis_blocks.vision._square import Blob, arrange, arrangement_cost, expected_radii, motion

Array = NDArray[np.float64]

FOUR_CIRCLES, THREE_CIRCLES, TWO_CIRCLES, NOT_FOUND, INCONSISTENT, STALE, UNCALIBRATED, UNUSABLE = range(8)
"""Status: four, three or two circles seen; no target; four circles that are no square; no picture yet; no
calibration; a picture that is empty, too small or not uint8 blue-green-red."""

QUALITY_MIN = 0.9  # of the median: a circle that lost a quarter of its area to something before it has 0.865
REACH = 8.0  # px, and half a radius: how far a circle may move between two pictures and still be followed
GROWTH_MAX = math.log(1.33)  # of the square from one picture to the next
TURN_MAX = 0.5  # rad, the same
BEND_MAX = 0.08  # of the side: how far three circles may leave a motion of the whole square
RADIUS_MAX = math.log(1.6)  # of a followed circle against its expected radius


class Detection(NamedTuple):
    """What a picture shows of the target, by corner 1..4.

    `centres` (4, 2) px with NaN rows for circles that are missing; `quality` (4,) measured over expected
    radius, NaN if missing; `status` as above; `places` (4, 6) what it takes to follow all four, also the
    missing ones: u, v and expected radius in px, colour over the ceiling's (blue, green, red).
    """

    centres: Array
    quality: Array
    status: int
    places: Array


class Place(NamedTuple):
    """Where a circle is expected: `centre` u + iv and `radius` in px, `ratio` its colour over the ceiling."""

    centre: complex
    radius: float
    ratio: Colour


def usable(pixels: object) -> bool:
    """Return whether this is a picture that can be searched."""
    if not isinstance(pixels, np.ndarray) or pixels.dtype != np.uint8 or pixels.ndim != 3:
        return False
    height, width, channels = pixels.shape
    return bool(channels == 3 and min(height, width) >= SMALLEST)


def nothing(status: int) -> Detection:
    """Return the detection of no circle."""
    return Detection(np.full((4, 2), np.nan), np.full(4, np.nan), status, np.zeros((4, 6)))


def search(pixels: Pixels, target: Target) -> Detection:
    """Look for the four circles all over a picture."""
    ceiling, blobs = find_blobs(pixels, target)
    if not all(blobs):
        return nothing(NOT_FOUND)
    corners = arrange(blobs, target.ratio)
    if corners is None:
        return nothing(INCONSISTENT)
    discs = [locate(pixels, ceiling, blob.centre, blob.radius) for blob in corners]
    return _square(discs, target) or nothing(INCONSISTENT if all(discs) else NOT_FOUND)


def follow(pixels: Pixels, target: Target, places: Array) -> Detection:
    """Look for the circles near their `places` (4, 6), and everywhere if one is not there."""
    ceiling = Ceiling(pixels, pixels.shape[1])
    known = [Place(complex(u, v), radius, (b, g, r)) for u, v, radius, b, g, r in places.tolist()]
    discs = [_followed(pixels, ceiling, target, corner, place) for corner, place in enumerate(known)]
    moved = _moved(discs, known)
    if moved is not None:
        # Those that were seen tell where the others went, which may be further than a circle is followed.
        for corner, place in enumerate(moved):
            discs[corner] = discs[corner] or _followed(pixels, ceiling, target, corner, place)
    whole = _square(discs, target)
    if whole is not None:
        return whole
    found = search(pixels, target)
    if found.status <= TWO_CIRCLES:
        return found
    moved = _moved(discs, known)
    return found if moved is None else _detection(discs, moved) or found


def _followed(pixels: Pixels, ceiling: Ceiling, target: Target, corner: int, place: Place) -> Disc | None:
    """Return a corner's circle near its last place, first by its last colour, then by the present one."""
    blue, green, red = (a * b for a, b in zip(ceiling.at(place.centre), place.ratio, strict=True))
    radius = place.radius
    rough = measure(pixels, ceiling, place.centre, radius, REACH + radius / 2, (blue, green, red))
    if rough is None or abs(math.log(rough.radius / radius)) > RADIUS_MAX:
        return None
    disc = locate(pixels, ceiling, rough.centre, max(radius, rough.radius))
    if disc is None or abs(math.log(disc.radius / radius)) > RADIUS_MAX:
        return None
    return disc if target.colours.nearest(disc.ratio)[0] == corner else None


def _square(discs: Sequence[Disc | None], target: Target) -> Detection | None:
    """Return the detection of four circles that form a square, or None."""
    whole = [disc for disc in discs if disc is not None]
    if len(whole) < 4:
        return None
    points = [disc.centre for disc in whole]
    radii = expected_radii(points, target.ratio)
    blobs = [Blob(disc.centre, disc.radius, 0.0) for disc in whole]
    if radii is None or arrangement_cost(blobs, target.ratio) == math.inf:
        return None
    places = [Place(disc.centre, radius, disc.ratio) for disc, radius in zip(whole, radii, strict=True)]
    return _detection(discs, places)


def _moved(discs: Sequence[Disc | None], known: Sequence[Place]) -> list[Place] | None:
    """Return where all circles are, if three or two moved together since the last picture; else None."""
    seen = [(place, disc) for place, disc in zip(known, discs, strict=True) if disc is not None]
    if not 2 <= len(seen) <= 3:
        return None
    factor, shift, left = motion([place.centre for place, _ in seen], [disc.centre for _, disc in seen])
    growth = abs(factor)
    side = abs(known[2].centre - known[0].centre) / math.sqrt(2)
    if not growth > 0 or left > BEND_MAX * side * growth or abs(math.log(growth)) > GROWTH_MAX:
        return None
    if abs(math.atan2(factor.imag, factor.real)) > TURN_MAX:
        return None
    return [
        Place(factor * place.centre + shift, place.radius * growth, place.ratio)
        if disc is None
        else Place(disc.centre, place.radius * growth, disc.ratio)
        for place, disc in zip(known, discs, strict=True)
    ]


def _detection(discs: Sequence[Disc | None], places: Sequence[Place]) -> Detection | None:
    """Return the circles except those that something hides in part; None if fewer than two are left."""
    pairs = zip(discs, places, strict=True)
    quality = np.array([math.nan if disc is None else disc.radius / place.radius for disc, place in pairs])
    table = np.array([(p.centre.real, p.centre.imag, p.radius, *p.ratio) for p in places])
    missing = ~(quality >= QUALITY_MIN * np.nanmedian(quality))
    centres = table[:, :2].copy()
    centres[missing] = np.nan
    count = 4 - int(missing.sum())
    return Detection(centres, quality, 4 - count, table) if count >= 2 else None
