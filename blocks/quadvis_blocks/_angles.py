"""Angles on the circle."""

from __future__ import annotations

import math

TURN = 2.0 * math.pi


def wrapped(angle: float) -> float:
    """Return the same direction in (-pi, pi]; an angle in that interval is returned bit for bit."""
    turned = angle - TURN * math.ceil((angle - math.pi) / TURN)
    return math.pi if turned > math.pi else turned  # one rounding step beyond pi is pi
