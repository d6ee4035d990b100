"""Gains from Riccati equations, solved by scipy, and what must hold so that there are any.

Source: B. D. O. Anderson, J. B. Moore, Optimal Control: Linear Quadratic Methods, chapters 2 and 3.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import ParameterError

ROUNDING = 1e-9  # relative, of eigenvalues


def refuse_indefinite(name: str, weight: Any, size: int, *, positive: bool = False) -> None:
    """Raise ParameterError unless a matrix is symmetric (size, size) and has no negative eigenvalue.

    What rounding makes of 0 counts as 0; with ``positive`` all eigenvalues must be above 0.
    """
    if np.shape(weight) != (size, size):
        raise ParameterError(
            name, f"{name} must be {size} x {size}, got {' x '.join(map(str, np.shape(weight)))}"
        )
    if not np.isfinite(weight).all():
        raise ParameterError(name, f"{name} must be finite")
    most = float(np.abs(weight).max())
    if np.abs(weight - weight.T).max() > ROUNDING * most:
        raise ParameterError(name, f"{name} must be symmetric")
    least = float(np.linalg.eigvalsh(weight / most if most else weight).min()) * most
    if positive and least <= 0.0:
        raise ParameterError(
            name, f"{name} must be positive definite, its smallest eigenvalue is {least:.3g}"
        )
    if least < -ROUNDING * most:
        problem = f"{name} must have no negative eigenvalue, its smallest is {least:.3g}"
        raise ParameterError(name, problem)


def lost_pole(a: Any, b: Any, discrete: bool) -> complex | None:
    """Return a pole that is not stable and that no input reaches; None if there is none."""
    for pole in np.linalg.eigvals(a):
        if (abs(pole) >= 1.0 - ROUNDING) if discrete else (pole.real >= -ROUNDING * max(1.0, abs(pole))):
            reached = np.hstack([a - pole * np.eye(len(a)), b])
            if np.linalg.matrix_rank(reached) < len(a):
                return complex(pole)
    return None


def lqr_gain(a: Any, b: Any, q: Any, r: Any, discrete: bool) -> Any:
    """Return the gain K (m, n) that minimises the sum or integral of x'Qx + u'Ru; u = -K x.

    ParameterError if an unstable mode cannot be reached, or if no gain makes the loop stable.
    """
    lost = lost_pole(a, b, discrete)
    if lost is not None:
        problem = (
            f"B must reach every mode that is not stable; it does not reach that with the pole {_text(lost)}"
        )
        raise ParameterError("B", problem)
    from scipy.linalg import solve_continuous_are, solve_discrete_are

    try:
        with np.errstate(all="ignore"):
            if discrete:
                p = solve_discrete_are(a, b, q, r)
                gain = np.linalg.solve(r + b.T @ p @ b, b.T @ p @ a)
            else:
                gain = np.linalg.solve(r, b.T @ solve_continuous_are(a, b, q, r))
            poles = np.linalg.eigvals(a - b @ gain)
    except (np.linalg.LinAlgError, ValueError):
        raise ParameterError("Q", _NO_GAIN) from None
    if not np.isfinite(poles).all() or max(np.abs(poles) - 1.0 if discrete else poles.real) >= 0.0:
        raise ParameterError("Q", _NO_GAIN)
    return gain


_NO_GAIN = "Q must weigh every mode that is not stable: no gain makes this loop stable"


def _text(pole: complex) -> str:
    return f"{pole.real:.4g}" if not pole.imag else f"{pole.real:.4g}{pole.imag:+.4g}j"
