"""Colour calibration without clicks, from one to five pictures of the target in any light.

The circles are known by size and square before their colours are; see `_colour_search`. Source: the colour
calibration of section 5.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis_blocks.vision._circles import Pixels, Target
from quadvis_blocks.vision._colour_evidence import DIGITS, ColourEvidence
from quadvis_blocks.vision._colour_names import check_order
from quadvis_blocks.vision._colour_search import RADIUS_MAX, RADIUS_MIN, Sighting, find_circles
from quadvis_blocks.vision._colours import NAMES, THRESHOLD, ColourCalibration
from quadvis_blocks.vision._detect import FOUR_CIRCLES, search

PICTURES_MAX = 5
CLIPPED = 250.0  # grey levels: from there on a channel may be over-exposed
DARK = 12.0  # grey levels: a ceiling below that has no colours
DISAGREE = 0.2  # of a picture's colours from those of all; four colours are at least 0.3 apart
SAME = 1.0  # px, and a tenth of the radius: how far the detector may find a circle from where it was


@dataclass(frozen=True, eq=False)
class Calibrated:
    """What pictures tell: the colours, and by picture its name, what was seen in it and how far off it is.

    `distances` (pictures, 4) are those of a picture's colours from those of all, as
    `ColourCalibration.nearest` measures them. `found` says whether the detector finds the circles again with
    the new colours. `warnings` are sentences for the user.
    """

    colours: ColourCalibration
    names: tuple[str, ...]
    sightings: tuple[Sighting, ...]
    distances: NDArray[np.float64]
    found: tuple[bool, ...]
    warnings: tuple[str, ...]


def calibrate_colours(
    pictures: Sequence[Pixels], names: Sequence[str], ratio: float, order: Sequence[str] = NAMES
) -> Calibrated:
    """Return the colours of the four circles in pictures, whose `names` are for messages.

    `ratio` is a circle's radius over the square's side; `order` names the colours of corners 1 to 4,
    clockwise. The colours are the medians of all pictures. `QuadvisError` says what is missing.
    """
    check_order(order)
    if not 0 < ratio < 0.5:
        raise QuadvisError("the radius must be above 0 and below half of the side, or circles overlap")
    if not 1 <= len(pictures) <= PICTURES_MAX:
        many = f"{len(pictures)} pictures" if pictures else "no pictures"
        raise QuadvisError(f"{many}; give one to {PICTURES_MAX} that show all four circles")
    whole = [np.ascontiguousarray(picture) for picture in pictures]
    seen = tuple(find_circles(*known, ratio, order) for known in zip(whole, names, strict=True))
    samples = np.round([sighting.ratios for sighting in seen], DIGITS)
    prototypes = np.round(np.median(samples, axis=0), DIGITS)
    plain = ColourCalibration(prototypes, _threshold(seen), tuple(order))
    distances = plain.distances(samples)
    evidence = ColourEvidence.of(samples, distances)
    colours = ColourCalibration(prototypes, plain.threshold, plain.names, evidence)
    found = tuple(
        _is_found(picture, sighting, colours, ratio) for picture, sighting in zip(whole, seen, strict=True)
    )
    if not any(found):
        raise QuadvisError(
            f"{', '.join(names)}: with these colours the detector does not find the circles again; take "
            "pictures in better light, with nothing but ceiling around the circles"
        )
    warnings = tuple(_warnings(seen, names, distances.max(axis=1).tolist(), found))
    return Calibrated(colours, tuple(names), seen, distances, found, warnings)


def _threshold(seen: Sequence[Sighting]) -> float:
    """Return the threshold of the file: the usual one, or half way up to the ceiling from a lighter paint."""
    darkest = [[sighting.grey * min(ratio) for ratio in sighting.ratios] for sighting in seen]
    lightest = float(np.median(darkest, axis=0).max())
    return round(min(max(THRESHOLD, (1 + lightest) / 2), 0.95), 3)


def _is_found(picture: Pixels, seen: Sighting, colours: ColourCalibration, ratio: float) -> bool:
    """Return whether the detector sees four circles where they are."""
    target = Target(colours, ratio, RADIUS_MIN / 2, RADIUS_MAX * picture.shape[1])
    found = search(picture, target)
    centres = found.centres[:, 0] + 1j * found.centres[:, 1]
    return found.status == FOUR_CIRCLES and all(
        abs(centre - disc.centre) < SAME + disc.radius / 10
        for centre, disc in zip(centres, seen.discs, strict=True)
    )


def _warnings(
    seen: Sequence[Sighting], names: Sequence[str], farthest: Sequence[float], found: Sequence[bool]
) -> Iterator[str]:
    """Yield what is wrong with pictures that were used all the same."""
    for sighting, name, off, again in zip(seen, names, farthest, found, strict=True):
        if max(map(max, sighting.lights)) >= CLIPPED:
            yield f"{name}: the ceiling is over-exposed, so its colours are not exact; take it darker"
        elif min(map(min, sighting.lights)) < DARK:
            yield f"{name}: the ceiling is nearly black, so its colours are not exact; take it brighter"
        if off > DISAGREE:
            yield f"{name}: its colours are up to {off:.2f} off those of all pictures; look for reflections"
        if not again:
            yield f"{name}: with these colours the detector does not find all four circles; leave it out"
