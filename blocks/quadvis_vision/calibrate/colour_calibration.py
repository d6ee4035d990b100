"""Colour calibration without clicks, from one to five pictures of the target in any light.

The circles are known by size and square before their colours are; see `_colour_search`. Source: the colour
calibration of section 5.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis_vision.calibrate.colour_names import check_order
from quadvis_vision.calibrate.colour_search import RADIUS_MAX, RADIUS_MIN, Sighting, find_circles
from quadvis_vision.detection.circles import Pixels, Target
from quadvis_vision.detection.colour_provenance import DIGITS, ColourEvidence
from quadvis_vision.detection.colours import NAMES, THRESHOLD, ColourCalibration
from quadvis_vision.detection.detect import search

PICTURES_MAX = 5
CLIPPED = 250.0  # grey levels: from there on a channel may be over-exposed
DARK = 12.0  # grey levels: a ceiling below that has no colours
DISAGREE = 0.2  # of a picture's colours from those of all; four colours are at least 0.3 apart
# No paint is brighter than white. Beside a grey ceiling one may be; then all four look lighter than beside a
# white one, where dark colours would be taken for black. So the ceiling is said to be as bright as the
# brightest paint, but no more than this: the colours must fit the pictures that they are from.
GREY_MAX = 1.8
SAME = 1.0  # px, and a tenth of the radius: how far the detector may find a circle from where it was


@dataclass(frozen=True, eq=False)
class Calibrated:
    """What pictures tell: the colours, and by picture its name, what was seen in it and how far off it is.

    `samples` (pictures, 4, 3) are its colours over the ceiling's, `distances` (pictures, 4) how far they are
    from those of all, as `ColourCalibration.nearest` measures it. `found` says how many circles the detector
    finds again with the new colours. `warnings` are sentences for the user.
    """

    colours: ColourCalibration
    names: tuple[str, ...]
    sightings: tuple[Sighting, ...]
    samples: NDArray[np.float64]
    distances: NDArray[np.float64]
    found: tuple[int, ...]
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
    measured = np.array([sighting.ratios for sighting in seen])
    # Colours that are alike may be told apart beside this ceiling only: then they stay as they are.
    tried = []
    for grey_max in (GREY_MAX, 1.0):
        colours, samples = _colours(measured, grey_max, order)
        found = tuple(_count_found(*of, colours, ratio) for of in zip(whole, seen, strict=True))
        tried.append((colours, samples, found))
        if min(found) == 4:
            break
    colours, samples, found = max(tried, key=lambda trial: sum(trial[2]))
    if max(found) < 3:
        raise QuadvisError(
            f"{', '.join(names)}: with these colours the detector does not find the circles again; take "
            "pictures in better light, with nothing but ceiling around the circles"
        )
    distances = colours.distances(samples)
    warnings = [*_warnings(seen, names, distances.max(axis=1).tolist(), found)]
    if colours is not tried[0][0]:
        warnings.append("the ceiling is darker than the paint; beside a brighter one, calibrate again")
    return Calibrated(colours, tuple(names), seen, samples, distances, found, tuple(warnings))


def _colours(
    measured: NDArray[np.float64], grey_max: float, order: Sequence[str]
) -> tuple[ColourCalibration, NDArray[np.float64]]:
    """Return the colours with their evidence, and the samples, of ratios (n, 4, 3) as measured.

    A ceiling is said to be up to `grey_max` times as bright as it is.
    """
    grey = measured.max(axis=(1, 2), keepdims=True).clip(1.0, grey_max)
    samples = np.round(measured / grey, DIGITS)
    prototypes = np.round(np.median(samples, axis=0), DIGITS)
    plain = ColourCalibration(prototypes, _threshold(measured), tuple(order))
    evidence = ColourEvidence.of(samples, plain.distances(samples))
    return ColourCalibration(prototypes, plain.threshold, plain.names, evidence), samples


def _threshold(measured: NDArray[np.float64]) -> float:
    """Return the threshold of the file: the usual one, or half way up to the ceiling from a lighter paint."""
    lightest = float(np.median(measured.min(axis=2), axis=0).max())
    return round(min(max(THRESHOLD, (1 + lightest) / 2), 0.95), 3)


def _count_found(picture: Pixels, seen: Sighting, colours: ColourCalibration, ratio: float) -> int:
    """Return how many circles the detector sees where they are; 0 if it sees one elsewhere."""
    target = Target(colours, ratio, RADIUS_MIN / 2, RADIUS_MAX * picture.shape[1])
    centres = [complex(u, v) for u, v in search(picture, target).centres.tolist() if not math.isnan(u)]
    there = [
        any(abs(centre - disc.centre) < SAME + disc.radius / 10 for disc in seen.discs) for centre in centres
    ]
    return len(there) if all(there) else 0


def _warnings(
    seen: Sequence[Sighting], names: Sequence[str], farthest: Sequence[float], found: Sequence[int]
) -> Iterator[str]:
    """Yield what is wrong with pictures that were used all the same."""
    for sighting, name, off, again in zip(seen, names, farthest, found, strict=True):
        if max(map(max, sighting.lights)) >= CLIPPED:
            yield f"{name}: the ceiling is over-exposed, so its colours are not exact; take it darker"
        elif min(map(min, sighting.lights)) < DARK:
            yield f"{name}: the ceiling is nearly black, so its colours are not exact; take it brighter"
        elif off > DISAGREE:
            yield f"{name}: its colours are up to {off:.2f} off those of all pictures; look for reflections"
        if again < 4:
            yield f"{name}: with these colours the detector finds {again} of its 4 circles again"
