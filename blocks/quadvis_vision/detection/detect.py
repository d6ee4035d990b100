"""From a picture to four circles: search the whole picture, or follow the circles of the picture before.

A search takes the best square of four circles. Without a square it takes three or two circles that cannot be
anything else; see `partial`. Once the circles are known, three or two that moved together keep the target.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.detection.blobs import find_blobs, reductions
from quadvis_vision.detection.circles import SMALLEST, Ceiling, Disc, Pixels, Target, locate, measure
from quadvis_vision.detection.colours import Colour
from quadvis_vision.detection.partial import Known, three_of_four, two_of_four, whole
from quadvis_vision.detection.square import Blob, arrangements, expected_radii, motion, square_cost

Array = NDArray[np.float64]

FOUR_CIRCLES, THREE_CIRCLES, TWO_CIRCLES, NOT_FOUND, INCONSISTENT, STALE, UNCALIBRATED, UNUSABLE = range(8)
"""Status: four, three or two circles seen; no target; four circles that are no square; no picture yet; no
calibration; a picture that is empty, too small, of another size or not uint8 blue-green-red."""

QUALITY_MIN = (
    0.9  # of the median: a circle that lost a fifth of its area, or a tenth of its diameter at an edge
)
SIZES_MAX = math.log(1.15)  # of whole circles of a new target against their median
CHOICES = 6  # squares that are measured at full resolution
ROUGH = 1.0  # px: error of a circle's place in a reduced picture
NEAR = 0.45  # largest distance of a colour from that of its circle where only two circles are seen
FEW = 8  # circles of one colour that are measured at full resolution where no four form a square
SLACK = 0.008  # of the picture's width: the usual movement of the first circle
REACH = 0.025  # of the picture's width, plus half a radius: the distance over which a circle is followed
GROWTH_MAX = math.log(1.33)  # of the square from one picture to the next
TURN_MAX = 0.5  # rad, the same
BEND_MAX = 0.08  # of the side: deviation of three circles from a motion of the whole square
RADIUS_MAX = math.log(1.6)  # of a followed circle against its expected radius


class Detection(NamedTuple):
    """The target in a picture, by corner 1..4.

    `centres` (4, 2) are in px, with NaN rows for missing circles; `quality` (4,) is that of the block, NaN
    for missing circles; `status` is one of the constants above. `places` (4, 6) serve to follow all four
    circles, missing ones too: u, v and expected radius in px, colour divided by the ceiling's (blue, green,
    red).
    """

    centres: Array
    quality: Array
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
    return Detection(np.full((4, 2), np.nan), np.full(4, np.nan), status, np.zeros((4, 6)))


def search(pixels: Pixels, target: Target, fewest: int = 2) -> Detection:
    """Search the whole picture for the circles; fewer than `fewest` are no target."""
    ceiling = Ceiling(pixels)
    status = NOT_FOUND
    blobs: Sequence[Sequence[Blob]] = ()
    for reduction in reductions(pixels):
        blobs, crowded = find_blobs(pixels, ceiling, target, reduction)
        if all(blobs):
            status = INCONSISTENT
            found = _four(pixels, ceiling, target, arrangements(blobs, target.ratio, CHOICES))
            if found is not None:
                return found
        if crowded:  # a larger size would show even more patches
            break
    if fewest < 4 and sum(map(bool, blobs)) >= fewest:
        return _few(pixels, ceiling, target, blobs, fewest) or nothing(status)
    return nothing(status)


def _four(
    pixels: Pixels, ceiling: Ceiling, target: Target, choices: Sequence[Sequence[Blob]]
) -> Detection | None:
    """Return the best of some squares after measuring them at full resolution, or None."""
    best, least = None, math.inf
    for corners in choices:
        discs = [locate(pixels, ceiling, blob.centre, blob.radius, ROUGH) for blob in corners]
        known = [disc for disc in discs if disc is not None]
        if len(known) < 4:
            continue
        radii, cost = _fit(known, target)
        if cost >= least:
            continue
        sizes = sorted(math.log(disc.radius / radius) for disc, radius in zip(known, radii, strict=True))
        # One of the four may be partly hidden.
        if sizes[3] - sizes[1] > SIZES_MAX or sum(disc.symmetry >= QUALITY_MIN for disc in known) < 3:
            continue
        best, least = _detection(known, _places(known, radii)), cost
    return best


def _few(
    pixels: Pixels, ceiling: Ceiling, target: Target, blobs: Sequence[Sequence[Blob]], fewest: int
) -> Detection | None:
    """Return three or two circles that can only be those of the target, or None."""
    discs: list[list[Disc]] = [[], [], [], []]
    alike: list[list[Disc]] = [[], [], [], []]
    for corner in range(4):
        for blob in blobs[corner][:FEW]:
            disc = locate(pixels, ceiling, blob.centre, blob.radius, ROUGH)
            if disc is not None and disc.symmetry >= QUALITY_MIN:
                discs[corner].append(disc)
                if blob.distance < NEAR:
                    alike[corner].append(disc)
    found = three_of_four(discs, target.ratio)
    if not found and fewest < 3 and sum(map(len, alike)) == 2:
        found = two_of_four(alike, target.ratio)
    return _known(found[0], target) if len(found) == 1 else None


def _known(known: Known, target: Target) -> Detection | None:
    """Return the detection of three or two circles."""
    radius = sum(disc.radius for disc in known.values()) / len(known)
    places = [
        CirclePlace(known[k].centre, known[k].radius, known[k].ratio)
        if k in known
        else CirclePlace(centre, radius, target.colours.ratios[k])
        for k, centre in enumerate(whole(known))
    ]
    return _detection([known.get(k) for k in range(4)], places)


def follow(pixels: Pixels, target: Target, places: Array, fewest: int = 2) -> Detection:
    """Search for the circles near their `places` (4, 6); if one is not there, search the whole picture."""
    ceiling = Ceiling(pixels)
    known = [CirclePlace(complex(u, v), radius, (b, g, r)) for u, v, radius, b, g, r in places.tolist()]
    discs: list[Disc | None] = [None] * 4
    before: list[complex] = []
    after: list[complex] = []
    for corner, place in enumerate(known):
        # The circles found so far predict the place of the next.
        centre, slack = place.centre, SLACK * pixels.shape[1]
        if before:
            factor, shift, _ = motion(before, after)
            centre, slack = factor * centre + shift, 0.0
        disc = _near(pixels, ceiling, target, corner, place, centre, slack)
        if disc is not None:
            discs[corner] = disc
            before.append(place.centre)
            after.append(disc.centre)
    moved = _moved(discs, known)
    if moved is not None:
        # The circles that were found predict the places of the others, even beyond the reach of following.
        for corner, place in enumerate(moved):
            discs[corner] = discs[corner] or _near(pixels, ceiling, target, corner, place, place.centre)
    seen = _square(discs, target)
    if seen is not None:
        return seen
    moved = _moved(discs, known)
    kept = None if moved is None else _detection(discs, moved)
    if kept is None:
        return search(pixels, target, fewest)
    # The search gives a better target only if it finds more circles than were followed.
    found = search(pixels, target, max(fewest, 5 - kept.status))
    return found if found.status < kept.status else kept


def _near(
    pixels: Pixels,
    ceiling: Ceiling,
    target: Target,
    corner: int,
    place: CirclePlace,
    centre: complex,
    slack: float = 0.0,
) -> Disc | None:
    """Return a corner's circle near a centre: at the centre, or found around it by its last colour."""
    radius = place.radius
    disc = locate(pixels, ceiling, centre, radius, slack)
    if slack and (disc is None or disc.symmetry < QUALITY_MIN):  # another thing may be beside the circle
        disc = locate(pixels, ceiling, centre, radius)
    if disc is not None and _same(disc, target, corner, radius):
        return disc
    light, ratio = ceiling.at(centre), place.ratio
    colour = (light[0] * ratio[0], light[1] * ratio[1], light[2] * ratio[2])
    rough = measure(pixels, ceiling, centre, radius, REACH * pixels.shape[1] + radius / 2, colour)
    if rough is None or abs(math.log(rough.radius / radius)) > RADIUS_MAX:
        return None
    disc = locate(pixels, ceiling, rough.centre, max(radius, rough.radius))
    return disc if disc is not None and _same(disc, target, corner, radius) else None


def _same(disc: Disc, target: Target, corner: int, radius: float) -> bool:
    return (
        abs(math.log(disc.radius / radius)) < RADIUS_MAX and target.colours.nearest(disc.ratio)[0] == corner
    )


def _square(discs: Sequence[Disc | None], target: Target) -> Detection | None:
    """Return the detection of four circles that form a square, or None."""
    known = [disc for disc in discs if disc is not None]
    if len(known) < 4:
        return None
    radii, cost = _fit(known, target)
    return None if cost == math.inf else _detection(known, _places(known, radii))


def _fit(discs: Sequence[Disc], target: Target) -> tuple[Sequence[float], float]:
    """Return the expected radii (px) of four circles, and their misfit to a square: infinity if none."""
    points = [disc.centre for disc in discs]
    radii = expected_radii(points, target.ratio)
    if radii is None:
        return (), math.inf
    return radii, square_cost(points, [disc.radius for disc in discs], radii)


def _places(discs: Sequence[Disc], radii: Sequence[float]) -> list[CirclePlace]:
    return [CirclePlace(disc.centre, radius, disc.ratio) for disc, radius in zip(discs, radii, strict=True)]


def _moved(discs: Sequence[Disc | None], known: Sequence[CirclePlace]) -> list[CirclePlace] | None:
    """Return the places of all circles if three or two moved together since the last picture, else None."""
    seen = [(place, disc) for place, disc in zip(known, discs, strict=True) if disc is not None]
    if not 2 <= len(seen) <= 3:
        return None
    before, after = [place.centre for place, _ in seen], [disc.centre for _, disc in seen]
    factor, shift, left = motion(before, after)
    growth = abs(factor)
    side = abs(known[2].centre - known[0].centre) / math.sqrt(2)
    if not growth > 0 or left > BEND_MAX * side * growth or abs(math.log(growth)) > GROWTH_MAX:
        return None
    if abs(math.atan2(factor.imag, factor.real)) > TURN_MAX:
        return None
    if len(seen) == 3:
        # Radii grow with the root of the area, as a tilt shortens one direction only.
        growth = math.sqrt(abs(_area(after) / (_area(before) or math.inf))) or growth
    return [
        CirclePlace(factor * place.centre + shift, place.radius * growth, place.ratio)
        if disc is None
        else CirclePlace(disc.centre, place.radius * growth, disc.ratio)
        for place, disc in zip(known, discs, strict=True)
    ]


def _area(points: Sequence[complex]) -> float:
    """Return twice the area of a triangle."""
    return ((points[1] - points[0]).conjugate() * (points[2] - points[0])).imag


def _detection(discs: Sequence[Disc | None], places: Sequence[CirclePlace]) -> Detection | None:
    """Return the detection without partly hidden circles; None if fewer than two circles are left."""
    quality = [
        math.nan if disc is None else min(disc.radius / place.radius, disc.symmetry)
        for disc, place in zip(discs, places, strict=True)
    ]
    order = sorted(part for part in quality if part == part)
    if not order:
        return None
    limit = QUALITY_MIN * (order[(len(order) - 1) // 2] + order[len(order) // 2]) / 2
    hidden = [corner for corner, part in enumerate(quality) if not part >= limit]
    if len(hidden) > 2:
        return None
    table = np.array([(p.centre.real, p.centre.imag, p.radius, *p.ratio) for p in places])
    centres = table[:, :2].copy()
    if hidden:
        centres[hidden] = math.nan
    return Detection(centres, np.array(quality), len(hidden), table)
