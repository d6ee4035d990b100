"""Recognise the target by three or two of its circles when the others are out of sight.

Three or two circles easily fit by chance. So their places, radii and ellipses must all agree, and no other
choice of circles in the picture may fit as well. Points are complex numbers u + iv (px).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations, product

from quadvis_vision.detection.circles import Disc
from quadvis_vision.detection.square import CORNERS, motion

Known = dict[int, Disc]  # by corner 0..3

SIZE_MAX = (
    0.03,
    0.35,
)  # of the circles against what their places make one expect: the second is px of radius
PAIR_MAX = (0.02, 0.15)  # the same for two circles alone
SPREAD_MAX = math.log(1.28)  # size of one circle relative to another: 25 deg of tilt nearby make a quarter
BEND_MAX = 0.25  # of a circle: by a tilt of 37 deg
BENDS_MAX = 0.18  # between the ellipses of two circles
CORNER_MAX = 0.12  # between the mean ellipse and that of three corners
BLUR = 5.0  # px^2: divided by r^2, the tolerance that motion blur adds to both


def three_of_four(discs: Sequence[Sequence[Disc]], ratio: float) -> list[Known]:
    """Return all choices of three circles, each of another corner, that may be three corners of a square."""
    found = []
    for missing in range(4):
        before, opposite, after = ((missing + k) % 4 for k in (3, 2, 1))
        for p, q in product(discs[before], discs[opposite]):
            if not _alike(p, q) or not _apart(q.centre - p.centre, p, q, 1.0, ratio):
                continue
            for r in discs[after]:
                if _alike(q, r) and _alike(r, p) and _corner(p, q, r, ratio):
                    found.append({before: p, opposite: q, after: r})
    return found


def two_of_four(discs: Sequence[Sequence[Disc]], ratio: float) -> list[Known]:
    """Return all choices of two circles, of two corners, whose distance agrees with sizes and ellipses."""
    found = []
    for i, j in combinations(range(4), 2):
        square = abs(CORNERS[j] - CORNERS[i]) ** 2
        for p, q in product(discs[i], discs[j]):
            if _alike(p, q) and _apart(q.centre - p.centre, p, q, square, ratio, PAIR_MAX):
                found.append({i: p, j: q})
    return found


def whole(known: Known) -> tuple[complex, complex, complex, complex]:
    """Return the centres of all four circles: known ones, and the others where a square would have them."""
    if len(known) == 3:
        (missing,) = set(range(4)) - set(known)
        before, opposite, after = (known[(missing + k) % 4].centre for k in (3, 2, 1))
        places = {corner: disc.centre for corner, disc in known.items()} | {
            missing: before + after - opposite
        }
        return places[0], places[1], places[2], places[3]
    factor, shift, _ = motion([CORNERS[k] for k in known], [disc.centre for disc in known.values()])
    p1, p2, p3, p4 = (known[k].centre if k in known else factor * CORNERS[k] + shift for k in range(4))
    return p1, p2, p3, p4


def _alike(p: Disc, q: Disc) -> bool:
    """Return whether two circles have the same size and ellipse."""
    if abs(math.log(p.radius / q.radius)) > SPREAD_MAX or max(abs(p.bend), abs(q.bend)) > BEND_MAX:
        return False
    return abs(p.bend - q.bend) < BENDS_MAX + BLUR / (p.radius * q.radius)


def _apart(
    step: complex, p: Disc, q: Disc, square: float, ratio: float, limits: tuple[float, float] = SIZE_MAX
) -> bool:
    """Return whether a step on the ceiling, `step` in the picture, has the squared length `square`.

    A circle's ellipse measures lengths on the ceiling. If A maps the ceiling to the picture, A A' has the
    ellipse's bend e and |A| = (r / ratio)^2, and the squared length is s' (A A')^-1 s =
    (|s|^2 - Re(conj(e) s^2)) / (|A| sqrt(1 - |e|^2)).
    """
    bend, radius = (p.bend + q.bend) / 2, (p.radius + q.radius) / 2
    length = abs(step) ** 2 - (bend.conjugate() * step * step).real
    length *= ratio * ratio / (radius * radius * math.sqrt(1 - abs(bend) ** 2))
    return abs(math.log(max(length, 1e-9) / square)) / 2 < limits[0] + limits[1] / radius


def _corner(p: Disc, q: Disc, r: Disc, ratio: float) -> bool:
    """Return whether three circles are successive corners of a square, clockwise, by sizes and ellipses."""
    a, b = p.centre - q.centre, r.centre - q.centre
    area = a.real * b.imag - a.imag * b.real
    if not area > 0:
        return False
    radius = (p.radius * q.radius * r.radius) ** (1 / 3)
    if abs(math.log(radius / (ratio * math.sqrt(area)))) > _size_max(radius):
        return False
    bend: complex = (a * a + b * b) / (abs(a) ** 2 + abs(b) ** 2)
    off: float = abs(bend - (p.bend + q.bend + r.bend) / 3)
    return bool(off < CORNER_MAX + BLUR / (radius * radius))


def _size_max(radius: float) -> float:
    return SIZE_MAX[0] + SIZE_MAX[1] / radius
