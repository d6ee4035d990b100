"""The arithmetic of a Kalman filter, written out for machine code.

Source: D. Simon, Optimal State Estimation, sections 5.1, 6.1 and 7.3.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import ParameterError
from quadvis_blocks.systems._products import row_times, times
from quadvis_blocks.systems._riccati import lost_pole

STEADY = 0


def steady(a: Any, seen: Any, q: Any) -> tuple[Any, Any]:
    """Return the gain (n, p) of infinite time for whitened measurements, and the covariance after them.

    ParameterError if a mode that is not stable does not show in the measurements.
    """
    lost = lost_pole(a.T, seen.T, discrete=True)
    if lost is not None:
        problem = f"C must show every mode that is not stable; it does not show that with the pole {lost:.4g}"
        raise ParameterError("C", problem)
    from scipy.linalg import solve_discrete_are

    try:
        with np.errstate(all="ignore"):
            before = solve_discrete_are(a.T, seen.T, q, np.eye(len(seen)))
            gain = np.linalg.solve(seen @ before @ seen.T + np.eye(len(seen)), seen @ before).T
            after = before - gain @ seen @ before
    except (np.linalg.LinAlgError, ValueError):
        raise ParameterError("Q", "Q must reach every mode that is not stable, for a steady gain") from None
    if not np.isfinite(gain).all():
        raise ParameterError("Q", "Q must be such that the steady gain is finite")
    return gain, 0.5 * (after + after.T)


def corrected(block: Any, y: Any, estimate: Any, covariance: Any) -> None:
    """Take the measurements into the estimate and its covariance, in place."""
    white = times(block.whitening, y)
    if block.gain == STEADY:
        for row in range(white.size):
            white[row] -= row_times(block.seen, row, estimate)
        estimate[:] = estimate + times(block.settled, white)
        return
    for number in range(white.size):
        seen = block.seen[number]
        across = times(covariance, seen)
        scale = 1.0
        for row in range(across.size):
            scale += seen[row] * across[row]
        gain = across / scale
        estimate[:] = estimate + gain * (white[number] - row_times(block.seen, number, estimate))
        _joseph(covariance, seen, across, gain)


def _joseph(covariance: Any, seen: Any, across: Any, gain: Any) -> None:
    """Replace P by (I - k c) P (I - k c)' + k k', symmetric to the bit; ``across`` is P c'."""
    size = gain.size
    left = np.empty((size, size))
    for row in range(size):
        for column in range(size):
            left[row, column] = covariance[row, column] - gain[row] * across[column]
    rest = times(left, seen)
    for row in range(size):
        for column in range(row, size):
            value = left[row, column] - rest[row] * gain[column] + gain[row] * gain[column]
            covariance[row, column] = value
            covariance[column, row] = value


def predicted(block: Any, estimate: Any, u: Any) -> Any:
    """Return A x + B u."""
    found = times(block.A, estimate)
    for row in range(found.size):
        found[row] += row_times(block.inputs, row, u)
    return found


def spread(block: Any, covariance: Any) -> Any:
    """Return A P A' + Q, symmetric to the bit."""
    size = covariance.shape[0]
    moved, found = np.empty((size, size)), np.empty((size, size))
    for row in range(size):
        moved[row] = times(covariance, block.A[row])  # a row of A P, since P is symmetric
    for row in range(size):
        for column in range(row, size):
            value = row_times(block.A, column, moved[row]) + block.Q[row, column]
            found[row, column] = value
            found[column, row] = value
    return found
