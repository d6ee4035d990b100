"""Zeros, poles and gain of Butterworth filters, as of scipy's ``butter``.

Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, chapter 7 and appendix B.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

BANDS = ("low", "high", "band", "stop")
LOW, HIGH, BAND, STOP = range(len(BANDS))
Roots = tuple[Any, Any, float]  # zeros, poles, gain


def analog(order: int, band: int, corners: Any) -> Roots:
    """Return the filter in s; ``corners`` (rad/s) are one, or two of a band."""
    half = np.exp(1j * np.pi * (2.0 * np.arange(order // 2) + order + 1.0) / (2.0 * order))
    poles = np.concatenate([half, half.conj(), np.full(order % 2, -1.0 + 0.0j)])
    none, zeros = np.zeros(0, complex), np.zeros(order, complex)
    if band == LOW:
        return none, poles * corners[0], float(corners[0]) ** order
    if band == HIGH:
        return zeros, corners[0] / poles, 1.0
    width, centre = corners[1] - corners[0], math.sqrt(corners[0] * corners[1])
    moved = 0.5 * width * poles if band == BAND else 0.5 * width / poles
    apart = np.sqrt(moved * moved - centre * centre)
    poles = np.concatenate([moved + apart, moved - apart])
    if band == BAND:
        return zeros, poles, float(width) ** order
    return np.concatenate([zeros + 1j * centre, zeros - 1j * centre]), poles, 1.0


def digital(order: int, band: int, corners: Any, period: float) -> Roots:
    """Return the filter in z: bilinear, with the corners (rad/s) at their place; period in s."""
    double = 2.0 / period
    zeros, poles, gain = analog(order, band, double * np.tan(np.asarray(corners) / double))
    scale = np.prod((double - zeros) / (double - poles[: len(zeros)]))
    scale /= np.prod(double - poles[len(zeros) :])
    mapped = (double + zeros) / (double - zeros)
    padded = np.concatenate([mapped, np.full(len(poles) - len(zeros), -1.0 + 0.0j)])
    return padded, (double + poles) / (double - poles), float(gain * scale.real)
