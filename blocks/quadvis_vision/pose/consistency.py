"""Whether circles can be those of the target, seen with about the tilt that is known: a validation gate.

A tilt turns a square into almost any parallelogram. So circles of a picture that is torn, a part of it from
another instant, look like those of a target that is tilted much, and a pose from them is wrong. Three circles
of a torn picture even fit exactly. Only the tilt that the inertial unit has measured contradicts them.
"""

from __future__ import annotations

import math

from quadvis_vision.pose.circles import Circle, misfit
from quadvis_vision.pose.refine import Tilt, Unknowns, pose_of, refine

SHAPE_MAX = 0.02  # sides; rms distance of circles from their places: 3 px of a side of 150 px
TILT_MAX = 0.25  # rad; distance of the measured tilt from the true one: of a unit that is mounted badly
TILT_MAX_OF_THREE = 0.1  # rad; three circles show a tear by the tilt alone; once four were seen, it is known


def is_a_square(circles: list[Circle], side: float, radius: float, level: Unknowns) -> bool:
    """Return whether a pose near the levelled one has the circles near where they are, and its tilt too.

    The two distances may be ``SHAPE_MAX`` and ``TILT_MAX`` (or that of three), and the sum of their squares,
    as shares of these, at most 1. The bound is that of a gross error, not of noise, since errors of a
    calibration or of a level last, and a gate that refuses them would refuse all frames. Two circles fit
    with any tilt.
    """
    allowed = SHAPE_MAX * side / level.z  # the size of the side from straight below
    if len(circles) < 3 or misfit(pose_of(level), circles, radius) <= allowed:
        return True
    weight, tilted = 1.0 / allowed, TILT_MAX if len(circles) > 3 else TILT_MAX_OF_THREE
    loose = [
        Circle(
            circle.u, circle.v, circle.x, circle.y, circle.forward, circle.right, (weight, 0.0, 0.0, weight)
        )
        for circle in circles
    ]
    found = refine(loose, radius, level, Tilt(level.roll, level.pitch, tilted / math.sqrt(len(circles))))
    if found is None:
        return False
    place = found.unknowns
    roll, pitch = (place.roll - level.roll) / tilted, (place.pitch - level.pitch) / tilted
    off = misfit(pose_of(place), circles, radius) / allowed
    return off * off + roll * roll + pitch * pitch <= 1.0
