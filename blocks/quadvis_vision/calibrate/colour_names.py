"""The meaning of colour names, which decide which of four circles is corner 1.

Geometry gives the clockwise order of the corners but not the first corner. The names give the first corner,
and show whether the picture is mirrored.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations

from quadvis.errors import QuadvisError, quoted, suggestion
from quadvis_vision.detection.colours import Colour

HUES = {  # deg
    "red": 0.0, "orange": 30.0, "yellow": 60.0, "green": 125.0, "cyan": 185.0, "blue": 225.0, "violet": 275.0,
    "magenta": 310.0,
}  # fmt: skip
KNOWN = (*HUES, "black")
CHROMA_MIN = 0.1  # largest minus smallest ratio; a smaller difference is no colour but a grey
FIT_MAX = 0.8  # distance of a colour from its name: 48 deg of hue, or a black as bright as 0.8 of the ceiling


def check_order(order: Sequence[str]) -> None:
    """Refuse colours that are unknown, not four or not different; `QuadvisError`."""
    for name in order:
        if name not in KNOWN:
            known = suggestion(name, KNOWN) or f"choose from {', '.join(KNOWN)}"
            raise QuadvisError(f"the colour {quoted(name)} is not known; {known}")
    if len(order) != 4 or len(set(order)) != 4:
        given = ", ".join(order) or "empty"
        raise QuadvisError(
            f"the order is {given}; it must be four different colours, clockwise from corner 1"
        )


def cost(ratios: Sequence[Colour], names: Sequence[str]) -> float:
    """Return the total distance of colours from their names; infinity if one colour does not fit its name."""
    parts = [_distance(ratio, name) for ratio, name in zip(ratios, names, strict=True)]
    return sum(parts) if max(parts) <= FIT_MAX else math.inf


def named(ratios: Sequence[Colour], names: Sequence[str]) -> tuple[str, ...] | None:
    """Return four names in the order that fits four colours best; None if they fit in no order."""
    best = min(permutations(names), key=lambda some: cost(ratios, some))
    return best if cost(ratios, best) < math.inf else None


def nearest_name(ratio: Colour) -> str:
    """Return the name that is nearest to a colour."""
    return min(KNOWN, key=lambda name: _distance(ratio, name))


def _distance(ratio: Colour, name: str) -> float:
    """Return the distance of a colour (blue, green, red over the ceiling) from a name, in steps of 60 deg."""
    blue, green, red = ratio
    chroma = max(ratio) - min(ratio)
    if name == "black":
        return 2 * chroma + min(ratio)
    hue = math.degrees(math.atan2(math.sqrt(3) * (green - blue), 2 * red - green - blue))
    off = abs(math.remainder(hue - HUES[name], 360)) / 60
    return off + 10 * max(0.0, 2 * CHROMA_MIN - chroma)
