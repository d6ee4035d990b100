"""Follow the four circles from the picture before; three or two that moved together keep the target."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from quadvis_vision.detection.blobs import looks
from quadvis_vision.detection.circles import Ceiling, CircleTarget, Disc, Pixels, discs, locate
from quadvis_vision.detection.detect import (
    INCONSISTENT,
    QUALITY_MIN,
    CirclePlace,
    Detection,
    detection,
    nothing,
    refined,
    search,
    square_seen,
)
from quadvis_vision.detection.measure import followed
from quadvis_vision.detection.square import expected_shapes, motion

Array = NDArray[np.float64]

REACH = 0.025  # of the picture's width, plus half a radius: the distance over which a circle is followed
GROWTH_MAX = math.log(1.33)  # of the square from one picture to the next
TURN_MAX = 0.5  # rad, the same
BEND_MAX = 0.08  # of the side: deviation of three circles from a motion of the whole square
PART_MAX = 0.6  # radii; half of a disc has its middle 0.42 from that of the disc
RADIUS_MAX = math.log(1.6)  # of a followed circle against its expected radius


def follow(pixels: Pixels, target: CircleTarget, places: Array, fewest: int = 2) -> Detection:
    """Search for the circles near their `places` (4, 6); if one is not there, search the whole picture."""
    known = [CirclePlace(complex(u, v), radius, (b, g, r)) for u, v, radius, b, g, r in places.tolist()]
    measured, exact = _followed(pixels, target, places)
    kept_discs: list[Disc | None] = [
        disc if disc is not None and _same(disc, target, corner, place.radius) else None
        for corner, (place, disc) in enumerate(zip(known, measured, strict=True))
    ]
    whole = [disc for disc in kept_discs if disc is not None and disc.symmetry >= QUALITY_MIN]
    if len(whole) < 4:
        _look_around(pixels, target, known, kept_discs)
        whole = [disc for disc in kept_discs if disc is not None]
        seen = refined(pixels, whole, target) if len(whole) == 4 else None
    else:
        seen = square_seen(whole, target) if exact else refined(pixels, whole, target)
    if seen is not None:
        return seen if _holds_together(seen, known) else nothing(INCONSISTENT)
    moved = _moved(kept_discs, known)
    kept = None if moved is None else detection(kept_discs, moved)
    if kept is not None and not _holds_together(kept, known):
        return nothing(INCONSISTENT)
    if kept is None:
        return search(pixels, target, fewest)
    # The search gives a better target only if it finds more circles than were followed.
    found = search(pixels, target, max(fewest, 5 - kept.status), thorough=False)
    return found if found.status < kept.status else kept


def _followed(pixels: Pixels, target: CircleTarget, places: Array) -> tuple[list[Disc | None], bool]:
    """Return what is near the places (4, 6), measured as the ellipses that the last square had.

    The second value is false if they moved or grew so much that their ellipses are others.
    """
    points = [complex(u, v) for u, v in places[:, :2].tolist()]
    shapes = expected_shapes(points, target.ratio)
    if shapes is None:
        shapes = places[:, 2, None, None] * np.eye(2)
    rows, exact = followed(pixels, places, shapes)
    return discs(rows), exact > 0


def _look_around(
    pixels: Pixels, target: CircleTarget, known: Sequence[CirclePlace], discs: list[Disc | None]
) -> None:
    """Add the circles that moved farther, by the blobs of their colours around the places to expect."""
    blobs = next(looks(pixels, Ceiling(pixels), target))
    moved = _moved(discs, known)
    reach = REACH * pixels.shape[1]
    for corner, disc in enumerate(discs):
        if disc is not None and disc.symmetry >= QUALITY_MIN:
            continue
        place = known[corner] if moved is None else moved[corner]
        near = [
            (abs(blob.centre - place.centre), blob)
            for blob in blobs[corner]
            if abs(math.log(blob.radius / place.radius)) < RADIUS_MAX
        ]
        guesses = [
            (blob.centre, blob.radius) for away, blob in sorted(near) if away < reach + place.radius / 2
        ]
        guesses = guesses[:1] if moved is None else [*guesses[:1], (place.centre, place.radius)]
        for other in locate(pixels, guesses):
            if other is None or not _same(other, target, corner, place.radius):
                continue
            best = discs[corner]
            if best is None or best.symmetry < other.symmetry:
                discs[corner] = other


def _holds_together(seen: Detection, known: Sequence[CirclePlace]) -> bool:
    """Return whether circles that are partly hidden are where the motion of the whole ones takes them.

    A part of a circle lies within the circle. In a picture that is torn through circles it may lie elsewhere.
    """
    whole = [corner for corner in range(4) if not math.isnan(seen.centres[corner, 0])]
    if len(whole) == 4:
        return True
    there = [complex(u, v) for u, v in seen.places[:, :2].tolist()]
    factor, shift, _ = motion([known[k].centre for k in whole], [there[k] for k in whole])
    return all(
        abs(factor * known[k].centre + shift - there[k]) <= PART_MAX * seen.places[k, 2]
        for k in range(4)
        if k not in whole
    )


def _same(disc: Disc, target: CircleTarget, corner: int, radius: float) -> bool:
    return (
        abs(math.log(disc.radius / radius)) < RADIUS_MAX and target.colours.nearest(disc.ratio)[0] == corner
    )


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
