"""The two gains of a proportional-derivative law, given or from a bandwidth."""

from __future__ import annotations

from typing import Any

from quadvis.block import ParameterError


def check_gains(gains: Any) -> None:
    """Raise ParameterError if only one of the two gains is zero."""
    if (gains[0] > 0.0) != (gains[1] > 0.0):
        problem = "gains must both be above 0, or both 0 to take them from the bandwidth"
        raise ParameterError("gains", f"{problem}, got {gains[0]:g}, {gains[1]:g}")


def gain_pair(gains: Any, bandwidth: float, inertia: float) -> tuple[float, float]:
    """Return damping and stiffness: the gains; if they are zero, those that give two poles at -bandwidth."""
    if gains[1] == 0.0:
        return 2.0 * inertia * bandwidth, inertia * bandwidth * bandwidth
    return gains[0], gains[1]
