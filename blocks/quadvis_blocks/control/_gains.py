"""The two gains of a proportional-derivative law, given or from a bandwidth, and the integral beside them."""

from __future__ import annotations

from typing import Any

from quadvis.block import ParameterError, saturated


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


def check_integral(integral: float, damping: float, stiffness: float, inertia: float) -> None:
    """Raise ParameterError if an integral of this rate (1/s) makes a double integrator unstable."""
    if integral >= damping / inertia:
        most = f"{damping / inertia:g} 1/s, the damping"
        raise ParameterError("integral", f"integral must be below {most}, got {integral:g} 1/s")


def integrated(
    integral: float, error: float, step: float, wanted: float, limit: float, stiffness: float
) -> float:
    """Return the integral of the errors after a step (rate times period) with an error.

    The integral stands still while the law wants more than its limit and the error asks for more still. It
    never asks for more than the limit by itself: it stays within `limit` / `stiffness`.
    """
    if abs(wanted) > limit and wanted * error < 0.0:
        return integral
    return float(saturated(integral + step * error, limit / stiffness))
