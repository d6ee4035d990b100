"""Find the four circles of a picture when their colours are not known yet, by their size and their square.

The search is for four whole circles of one size and of four colours at the corners of a square. Source: to
find shapes first and to learn their colours afterwards is from Gunnarsson, Wiesel and Rojas, "The Color and
the Shape".
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis_vision.calibrate.colour_names import cost, named, nearest_name
from quadvis_vision.detection.blobs import ReducedPicture
from quadvis_vision.detection.circles import SMALLEST, Ceiling, Disc, Pixels, locate
from quadvis_vision.detection.colours import APART, THRESHOLD, Colour, tone
from quadvis_vision.detection.detect import BENDS_MAX, usable
from quadvis_vision.detection.square import expected_bends, expected_radii, expected_shapes, square_cost

THRESHOLDS = (THRESHOLD, 0.9, 0.55)  # tried one after the other, as the colours are unknown
WIDTH = 400  # px: about the size to which a picture is reduced for a first look
RADIUS_MIN = 3.0  # px
RADIUS_MAX = 0.2  # of the picture's width
CIRCLES_MAX = 60  # that are considered; the time to arrange circles grows with the square of their number
GUESSES_MAX = 300  # patches that are measured
SYMMETRY_MIN = 0.85  # of a whole circle
SIZES_MAX = math.log(1.2)  # size of one circle relative to the others
NEIGHBOURS = 0.3  # of half a diagonal: distance of a corner from the place that two opposite corners predict
INSIDE = 0.7  # of the radius: a circle's colour is measured within this radius
RING = (1.3, 1.7)  # of the radius: the ceiling's colour is measured between these radii
STAINED = 0.5  # of the ceiling's light: a ring that differs by more contains another thing


@dataclass(frozen=True)
class Sighting:
    """The four circles of one picture, clockwise.

    `discs` are the measured circles; the `ratio` of each is its mean colour divided by the colour of the
    ceiling around it (blue, green, red). `lights` are the grey levels of the ceiling around each circle.
    """

    discs: tuple[Disc, ...]
    lights: tuple[Colour, ...]

    @property
    def ratios(self) -> tuple[Colour, ...]:
        """The colours."""
        return tuple(disc.ratio for disc in self.discs)

    def turned(self, steps: int) -> Sighting:
        """Return the same circles in the same order, beginning `steps` circles later."""
        discs, lights = ((*part[steps:], *part[:steps]) for part in (self.discs, self.lights))
        return replace(self, discs=discs, lights=lights)


def find_circles(pixels: Pixels, name: str, ratio: float, order: Sequence[str]) -> Sighting:
    """Return the four circles of a picture from corner 1 on; `QuadvisError` if they are not found.

    `name` names the picture in messages, `ratio` is a circle's radius over the square's side, `order` names
    the colours of corners 1 to 4. Of several squares the one with these colours is returned.
    """
    if not usable(pixels):
        raise QuadvisError(f"{name}: this is no colour picture of {SMALLEST} x {SMALLEST} px or more")
    if np.ptp(pixels, axis=2).max() == 0:
        raise QuadvisError(f"{name}: the picture has no colours; take it with a colour camera")
    ceiling = Ceiling(pixels)
    strange: Sighting | None = None
    most = 0
    for threshold in THRESHOLDS:
        discs = _discs(pixels, ceiling, threshold)
        most = max(most, len(discs))
        best, least = None, math.inf
        for corners, misfit in _squares(discs, ratio):
            seen = _look(pixels, ceiling, corners)
            if min(math.dist(tone(a), tone(b)) for a, b in combinations(seen.ratios, 2)) < APART:
                continue
            begun = _begun(seen, order)
            total = math.inf if begun is None else misfit + cost(begun.ratios, order)
            if total < least:
                best, least = begun, total
            if begun is None and (strange is None or named(seen.ratios, order)):
                strange = seen
        if best is not None:
            return best
    raise QuadvisError(_missing(name, most) if strange is None else _other(name, strange, order))


def _begun(seen: Sighting, order: Sequence[str]) -> Sighting | None:
    """Return a sighting turned to begin at corner 1; None if its colours are not in that cyclic order."""
    names = named(seen.ratios, order)
    for steps in range(4):
        if names is not None and (*names[steps:], *names[:steps]) == tuple(order):
            return seen.turned(steps)
    return None


def _missing(name: str, count: int) -> str:
    circles = "no circle" if not count else "1 circle" if count == 1 else f"{count} circles"
    problem = f"{name}: {circles} and no square of four in different colours"
    return f"{problem}; take a picture that shows all four whole, with some ceiling around each"


def _other(name: str, seen: Sighting, order: Sequence[str]) -> str:
    given, names = ", ".join(order), named(seen.ratios, order)
    if names is None:
        found = ", ".join(nearest_name(ratio) for ratio in seen.ratios)
        problem = f"{name}: the circles look {found} (clockwise), which does not fit the order {given}"
        return f"{problem}; name their colours clockwise, beginning with corner 1"
    first = names.index(order[0])
    found = ", ".join((*names[first:], *names[:first]))
    problem = f"{name}: the circles are clockwise {found}, against the order {given}"
    return f"{problem}; if the picture is not mirrored, name them as they are"


def _discs(pixels: Pixels, ceiling: Ceiling, threshold: float) -> list[Disc]:
    """Return all whole circles, the largest first."""
    reduction = max(2, round(pixels.shape[1] / WIDTH))
    view, limits = ReducedPicture(pixels, ceiling, reduction), (RADIUS_MIN, RADIUS_MAX * pixels.shape[1])
    # Lines that touch a circle join its patch; they vanish at lower thresholds, or where they are closed.
    looks = (view.lower(threshold, limits), view.closed(threshold, limits))
    patches = [*view.plain(threshold, limits), *(patch for look in looks for some in look for patch in some)]
    guesses = [(centre, radius) for centre, radius, _ in sorted(patches, key=lambda patch: -patch[1])]
    found: list[Disc] = []
    for disc in locate(pixels, guesses[:GUESSES_MAX]):
        if disc is None or disc.symmetry < SYMMETRY_MIN:
            continue
        if all(abs(disc.centre - other.centre) > disc.radius for other in found):
            found.append(disc)
    return found[:CIRCLES_MAX]


def _squares(discs: Sequence[Disc], ratio: float) -> Iterator[tuple[tuple[Disc, ...], float]]:
    """Yield every four circles, clockwise, that may be a square's corners, with the cost of the square."""
    for first, third in combinations(discs, 2):
        middle, half = (first.centre + third.centre) / 2, (third.centre - first.centre) / 2
        seconds, fourths = (
            [disc for disc in discs if abs(disc.centre - middle - turn * half) < NEIGHBOURS * abs(half)]
            for turn in (-1j, 1j)
        )
        for second in seconds:
            for fourth in fourths:
                corners = (first, second, third, fourth)
                points = [disc.centre for disc in corners]
                radii = expected_radii(points, ratio)
                if radii is None:
                    continue
                misfit = square_cost(points, [disc.radius for disc in corners], radii)
                if misfit == math.inf:
                    continue
                sizes = [math.log(disc.radius / radius) for disc, radius in zip(corners, radii, strict=True)]
                if max(sizes) - min(sizes) < SIZES_MAX and _whole(corners, ratio):
                    yield corners, misfit


def _whole(corners: Sequence[Disc], ratio: float) -> bool:
    """Return whether each circle has the ellipse of such a square; a partly hidden one has not."""
    shapes = expected_shapes([disc.centre for disc in corners], ratio)
    if shapes is None:
        return False
    off = [
        abs(disc.bend - bend) * disc.radius
        for disc, bend in zip(corners, expected_bends(shapes), strict=True)
    ]
    return all(
        part < BENDS_MAX[0] * disc.radius + BENDS_MAX[1] for part, disc in zip(off, corners, strict=True)
    )


def _look(pixels: Pixels, ceiling: Ceiling, corners: Sequence[Disc]) -> Sighting:
    """Return four circles with exact colours: the mean inside each over the median of a ring around it."""
    discs, lights = [], []
    for disc in corners:
        paint, light = _paint_and_light(pixels, disc, np.array(ceiling.at(disc.centre)))
        discs.append(disc._replace(ratio=_colour(paint / light)))
        lights.append(_colour(light))
    return Sighting(tuple(discs), tuple(lights))


def _colour(levels: Any) -> Colour:
    blue, green, red = levels.tolist()
    return blue, green, red


def _paint_and_light(pixels: Pixels, disc: Disc, coarse: Any) -> tuple[Any, Any]:
    """Return the levels of a circle and of the ceiling around it; `coarse` ones where the ring is stained."""
    reach = math.ceil(RING[1] * disc.radius)
    left, top = (max(0, int(part) - reach) for part in (disc.centre.real, disc.centre.imag))
    window: Any = pixels[top : top + 2 * reach + 2, left : left + 2 * reach + 2].astype(np.float64)
    v, u = np.mgrid[: window.shape[0], : window.shape[1]]
    away = np.hypot(u + left - disc.centre.real, v + top - disc.centre.imag) / disc.radius
    ring = window[(away > RING[0]) & (away < RING[1])]
    light = np.median(ring, axis=0) if len(ring) else coarse
    clear = np.abs(light - coarse) < STAINED * coarse
    return window[away < INSIDE].mean(axis=0), np.maximum(np.where(clear, light, coarse), 1.0)
