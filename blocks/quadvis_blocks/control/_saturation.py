"""The paper's saturation function."""

from __future__ import annotations


def saturated(value: float, limit: float) -> float:
    """Return ``value`` held to [-limit, limit]: sigma_a(s) of section 4; NaN stays NaN."""
    if value < -limit:
        return -limit
    return limit if value > limit else value
