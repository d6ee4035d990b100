"""Colour calibration without clicks, from one to five pictures of the target in any light.

The circles are found by their size and by the square that they form, before their colours are known; see
`colour_search`. Source: the colour calibration of section 5.
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
from quadvis_vision.detection.circles import CircleTarget, Pixels
from quadvis_vision.detection.colour_provenance import DIGITS, ColourEvidence
from quadvis_vision.detection.colours import NAMES, THRESHOLD, ColourCalibration
from quadvis_vision.detection.detect import search

PICTURES_MAX = 5
CLIPPED = 250.0  # grey levels: a channel at or above this level may be over-exposed
DARK = 12.0  # grey levels: a ceiling below this level has no measurable colour
DISAGREE = 0.2  # distance of a picture's colours from the colours of all; four colours are at least 0.3 apart
# No paint is brighter than a white ceiling. A paint brighter than the ceiling means that the ceiling is grey;
# then all four colours look lighter than beside white, and beside white the dark ones would be taken for
# black. So the ceiling counts as at most as bright as the brightest paint, corrected by no more than this
# factor: the colours must still fit the pictures that they come from.
GREY_MAX = 1.8
SAME = 1.0  # px, plus a tenth of the radius: the detector finds the same circle if it is no further away


@dataclass(frozen=True, eq=False)
class Calibrated:
    """The result of a colour calibration: the colours, and for each picture its name, circles and errors.

    `samples` (pictures, 4, 3) are the colours in each picture divided by the ceiling's; `distances`
    (pictures, 4) are their distances from the calibrated colours, as `ColourCalibration.nearest` measures
    them. `found` counts the circles that the detector finds again with the new colours. `warnings` are
    sentences for the user.
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
    clockwise. The colours are the medians over all pictures. `QuadvisError` says what is missing.
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
    # Similar colours may be separable beside this very ceiling only: then they are not corrected.
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
    """Return the colours with their evidence, and the samples, from measured ratios (n, 4, 3).

    A grey ceiling is corrected by up to the factor `grey_max`.
    """
    grey = measured.max(axis=(1, 2), keepdims=True).clip(1.0, grey_max)
    samples = np.round(measured / grey, DIGITS)
    prototypes = np.round(np.median(samples, axis=0), DIGITS)
    plain = ColourCalibration(prototypes, _threshold(measured), tuple(order))
    evidence = ColourEvidence.of(samples, plain.distances(samples))
    return ColourCalibration(prototypes, plain.threshold, plain.names, evidence), samples


def _threshold(measured: NDArray[np.float64]) -> float:
    """Return the usual threshold; with a lighter paint, the middle between that paint and the ceiling."""
    lightest = float(np.median(measured.min(axis=2), axis=0).max())
    return round(min(max(THRESHOLD, (1 + lightest) / 2), 0.95), 3)


def _count_found(picture: Pixels, seen: Sighting, colours: ColourCalibration, ratio: float) -> int:
    """Return the number of circles that the detector finds in their places; 0 if it finds one elsewhere."""
    target = CircleTarget(colours, ratio, RADIUS_MIN / 2, RADIUS_MAX * picture.shape[1])
    centres = [complex(u, v) for u, v in search(picture, target).centres.tolist() if not math.isnan(u)]
    there = [
        any(abs(centre - disc.centre) < SAME + disc.radius / 10 for disc in seen.discs) for centre in centres
    ]
    return len(there) if all(there) else 0


def _warnings(
    seen: Sequence[Sighting], names: Sequence[str], farthest: Sequence[float], found: Sequence[int]
) -> Iterator[str]:
    """Yield a warning for each fault of a picture that was used nevertheless."""
    for sighting, name, off, again in zip(seen, names, farthest, found, strict=True):
        if max(map(max, sighting.lights)) >= CLIPPED:
            yield f"{name}: the ceiling is over-exposed, so its colours are not exact; take it darker"
        elif min(map(min, sighting.lights)) < DARK:
            yield f"{name}: the ceiling is nearly black, so its colours are not exact; take it brighter"
        elif off > DISAGREE:
            yield f"{name}: its colours are up to {off:.2f} off those of all pictures; look for reflections"
        if again < 4:
            yield f"{name}: with these colours the detector finds {again} of its 4 circles again"
