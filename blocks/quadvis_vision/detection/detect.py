"""From a picture to four circles: search the whole of it, or follow those of the picture before.

A search takes the best square of four circles. If there is none, it takes three or two circles that can be
nothing else; see `_partial`. Once the circles are known, three or two that moved together keep the target.
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
CHOICES = 6  # squares that are looked at closely
ROUGH = 1.0  # px: how badly a reduced picture may place a circle
NEAR = 0.45  # largest distance of a colour from that of its circle where only two are seen
FEW = 8  # circles of one colour that are looked at closely where no four make a square
SLACK = 0.008  # of the picture's width: how far the first circle moves as a rule
REACH = 0.025  # of the picture's width, and half a radius: how far a circle is followed
GROWTH_MAX = math.log(1.33)  # of the square from one picture to the next
TURN_MAX = 0.5  # rad, the same
BEND_MAX = 0.08  # of the side: how far three circles may leave a motion of the whole square
RADIUS_MAX = math.log(1.6)  # of a followed circle against its expected radius


class Detection(NamedTuple):
    """What a picture shows of the target, by corner 1..4.

    `centres` (4, 2) px with NaN rows for circles that are missing; `quality` (4,) as of the block, NaN if
    missing; `status` as above; `places` (4, 6) what it takes to follow all four, also the missing ones: u,
    v and expected radius in px, colour over the ceiling's (blue, green, red).
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


def usable(pixels: object, size: tuple[int, int] | None = None) -> bool:
    """Return whether this is a picture that can be searched, of that width and height (px) if given."""
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
    """Look for the circles all over a picture; fewer than `fewest` are no target."""
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
        if crowded:  # at a larger size there is only more of it
            break
    if fewest < 4 and sum(map(bool, blobs)) >= fewest:
        return _few(pixels, ceiling, target, blobs, fewest) or nothing(status)
    return nothing(status)


def _four(
    pixels: Pixels, ceiling: Ceiling, target: Target, choices: Sequence[Sequence[Blob]]
) -> Detection | None:
    """Return the best of some squares after a close look, or None."""
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
        # One of the four may be hidden in part.
        if sizes[3] - sizes[1] > SIZES_MAX or sum(disc.symmetry >= QUALITY_MIN for disc in known) < 3:
            continue
        best, least = _detection(known, _places(known, radii)), cost
    return best


def _few(
    pixels: Pixels, ceiling: Ceiling, target: Target, blobs: Sequence[Sequence[Blob]], fewest: int
) -> Detection | None:
    """Return three or two circles that can be nothing else than those of the target, or None."""
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
        Place(known[k].centre, known[k].radius, known[k].ratio)
        if k in known
        else Place(centre, radius, target.colours.ratios[k])
        for k, centre in enumerate(whole(known))
    ]
    return _detection([known.get(k) for k in range(4)], places)


def follow(pixels: Pixels, target: Target, places: Array, fewest: int = 2) -> Detection:
    """Look for the circles near their `places` (4, 6), and everywhere if one is not there."""
    ceiling = Ceiling(pixels)
    known = [Place(complex(u, v), radius, (b, g, r)) for u, v, radius, b, g, r in places.tolist()]
    discs: list[Disc | None] = [None] * 4
    before: list[complex] = []
    after: list[complex] = []
    for corner, place in enumerate(known):
        # The circles that are already found tell where to look for the next.
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
        # Those that were seen tell where the others went, which may be further than a circle is followed.
        for corner, place in enumerate(moved):
            discs[corner] = discs[corner] or _near(pixels, ceiling, target, corner, place, place.centre)
    seen = _square(discs, target)
    if seen is not None:
        return seen
    moved = _moved(discs, known)
    kept = None if moved is None else _detection(discs, moved)
    if kept is None:
        return search(pixels, target, fewest)
    # Only more circles than those that were followed are a better target.
    found = search(pixels, target, max(fewest, 5 - kept.status))
    return found if found.status < kept.status else kept


def _near(
    pixels: Pixels,
    ceiling: Ceiling,
    target: Target,
    corner: int,
    place: Place,
    centre: complex,
    slack: float = 0.0,
) -> Disc | None:
    """Return a corner's circle near a centre: at once if it is there, else around it by its last colour."""
    radius = place.radius
    disc = locate(pixels, ceiling, centre, radius, slack)
    if slack and (disc is None or disc.symmetry < QUALITY_MIN):  # there may be something else beside it
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
    """Return the radii (px) expected of four circles, and how badly they fit a square: infinity if not."""
    points = [disc.centre for disc in discs]
    radii = expected_radii(points, target.ratio)
    if radii is None:
        return (), math.inf
    return radii, square_cost(points, [disc.radius for disc in discs], radii)


def _places(discs: Sequence[Disc], radii: Sequence[float]) -> list[Place]:
    return [Place(disc.centre, radius, disc.ratio) for disc, radius in zip(discs, radii, strict=True)]


def _moved(discs: Sequence[Disc | None], known: Sequence[Place]) -> list[Place] | None:
    """Return where all circles are, if three or two moved together since the last picture; else None."""
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
        Place(factor * place.centre + shift, place.radius * growth, place.ratio)
        if disc is None
        else Place(disc.centre, place.radius * growth, disc.ratio)
        for place, disc in zip(known, discs, strict=True)
    ]


def _area(points: Sequence[complex]) -> float:
    """Return twice the area of a triangle."""
    return ((points[1] - points[0]).conjugate() * (points[2] - points[0])).imag


def _detection(discs: Sequence[Disc | None], places: Sequence[Place]) -> Detection | None:
    """Return the circles except those that something hides in part; None if fewer than two are left."""
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
