"""What the names of colours mean: which of four circles, seen clockwise, is corner 1.

Geometry gives the order of the corners but not the first one. The names tell it, and whether the picture is
mirrored.
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
CHROMA_MIN = 0.1  # largest minus smallest ratio of what is called a colour
FIT_MAX = 0.8  # of a colour from what its name says: 48 deg of hue, or a black of 0.8 of the ceiling


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
    """Return how far colours are from what their names say, all together; infinity if one is none of that."""
    parts = [_distance(ratio, name) for ratio, name in zip(ratios, names, strict=True)]
    return sum(parts) if max(parts) <= FIT_MAX else math.inf


def named(ratios: Sequence[Colour], names: Sequence[str]) -> tuple[str, ...] | None:
    """Return four names in the order in which they fit four colours best; None if they do not fit in any."""
    best = min(permutations(names), key=lambda some: cost(ratios, some))
    return best if cost(ratios, best) < math.inf else None


def nearest_name(ratio: Colour) -> str:
    """Return the name of a colour."""
    return min(KNOWN, key=lambda name: _distance(ratio, name))


def _distance(ratio: Colour, name: str) -> float:
    """Return how far a colour (blue, green, red over the ceiling) is from its name, in steps of 60 deg."""
    blue, green, red = ratio
    chroma = max(ratio) - min(ratio)
    if name == "black":
        return 2 * chroma + min(ratio)
    hue = math.degrees(math.atan2(math.sqrt(3) * (green - blue), 2 * red - green - blue))
    off = abs(math.remainder(hue - HUES[name], 360)) / 60
    return off + 10 * max(0.0, 2 * CHROMA_MIN - chroma)
