"""Sampled systems from continuous ones, by the formulas of scipy's ``cont2discrete`` and of python-control.

Sources: scipy.signal.cont2discrete; G. F. Franklin, J. D. Powell, M. Workman, Digital Control of Dynamic
Systems, chapter 6.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis_blocks.systems._models import Model, degree, of_roots

METHODS = ("continuous", "zoh", "tustin", "matched", "foh", "impulse", "forward", "backward", "discrete")
CONTINUOUS, ZOH, TUSTIN, MATCHED, FOH, IMPULSE, FORWARD, BACKWARD, DISCRETE = range(len(METHODS))
WORDS = (
    "how the system is computed: continuous, by the solver; discrete, the coefficients are those of the "
    "block's rate; or sampled at this rate by the method of this name"
)
# After these methods the output follows the input of the same sample, though the continuous one does not.
DIRECT = (TUSTIN, FOH, IMPULSE, BACKWARD)
_SHARES = {FORWARD: 0.0, TUSTIN: 0.5, BACKWARD: 1.0}  # of the later sample, in the generalised bilinear rule


def sampled(model: Model, method: int, period: float, prewarp: float = 0.0) -> Model:
    """Return a continuous system sampled with a period (s), by any method but ``MATCHED``.

    ``prewarp`` (rad/s), of ``TUSTIN``, is the frequency at which both have the same response; 0 is none.
    """
    if prewarp:
        period = 2.0 * math.tan(0.5 * prewarp * period) / prewarp
    if method in _SHARES:
        return _bilinear(model, _SHARES[method], period)
    from scipy.linalg import expm

    a, b, c, d = model
    states, inputs = b.shape
    exponent = np.zeros((states + 2 * inputs, states + 2 * inputs))
    exponent[:states, :states] = a * period
    exponent[:states, states : states + inputs] = b * period
    if method == FOH:
        exponent[states : states + inputs, states + inputs :] = np.eye(inputs)
    moved = expm(exponent)
    held, step = moved[:states, :states], moved[:states, states : states + inputs]
    if method == ZOH:
        return Model(held, step, c, d)
    if method == FOH:
        ramp = moved[:states, states + inputs :]
        return Model(held, step - ramp + held @ ramp, c, d + c @ ramp)
    return Model(held, held @ b * period, c, c @ b * period)


def _bilinear(model: Model, share: float, period: float) -> Model:
    a, b, c, d = model
    later = np.eye(len(a)) - share * period * a
    moved = np.linalg.solve(later, np.eye(len(a)) + (1.0 - share) * period * a)
    step = np.linalg.solve(later, period * b)
    seen = np.linalg.solve(later.T, c.T).T
    return Model(moved, step, seen, d + share * c @ step)


def matched(zeros: Any, poles: Any, gain: float, period: float) -> Model:
    """Return a continuous system sampled by its zeros and poles, z = exp(s T), with the same gain at 0.

    No zero and no pole is 0.
    """
    at_rest = gain * np.prod(np.negative(zeros)) / np.prod(np.negative(poles))
    mapped_zeros, mapped_poles = (np.exp(np.asarray(roots, complex) * period) for roots in (zeros, poles))
    same = np.prod(1.0 - mapped_zeros) / np.prod(1.0 - mapped_poles)
    return of_roots(mapped_zeros, mapped_poles, float((at_rest / same).real))


def roots_of(numerator: Any, denominator: Any) -> tuple[Any, Any, float]:
    """Return the zeros, the poles and the gain of a system from its polynomials, highest power first."""
    num, den = (np.asarray(each, float)[-degree(each) - 1 :] for each in (numerator, denominator))
    return np.roots(num), np.roots(den), float(num[0] / den[0])
