"""The arithmetic of a Kalman filter, written out for machine code.

Source: D. Simon, Optimal State Estimation, sections 5.1, 6.1 and 7.3.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import ParameterError
from quadvis_blocks.systems._riccati import lost_pole


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


def corrected(block: Any, y: Any) -> None:
    """Take the measurements into the estimate and its covariance."""
    estimate, covariance = block.estimate, block.remaining
    size = estimate.size
    across, gain, left = np.empty(size), np.empty(size), np.empty((size, size))
    for number in range(y.size):
        miss, scale = _whitened(block, y, number), 1.0
        for row in range(size):
            total = 0.0
            for column in range(size):
                total += covariance[row, column] * block.seen[number, column]
            across[row] = total
            scale += block.seen[number, row] * total
            miss -= block.seen[number, row] * estimate[row]
        for row in range(size):
            gain[row] = across[row] / scale
            estimate[row] += gain[row] * miss
            for column in range(size):
                left[row, column] = covariance[row, column] - gain[row] * across[column]
        # Joseph's form, (I - k c) P (I - k c)' + k k', symmetric to the bit; across is P c'.
        for row in range(size):
            rest = 0.0
            for column in range(size):
                rest += left[row, column] * block.seen[number, column]
            for column in range(row, size):
                value = left[row, column] - rest * gain[column] + gain[row] * gain[column]
                covariance[row, column] = value
                covariance[column, row] = value


def corrected_steadily(block: Any, y: Any) -> None:
    """Take the measurements into the estimate by the steady gain."""
    estimate = block.estimate
    miss = np.empty(y.size)
    for number in range(y.size):
        total = _whitened(block, y, number)
        for column in range(estimate.size):
            total -= block.seen[number, column] * estimate[column]
        miss[number] = total
    for row in range(estimate.size):
        for number in range(y.size):
            estimate[row] += block.settled[row, number] * miss[number]


def _whitened(block: Any, y: Any, number: int) -> float:
    """Return one measurement with noise of variance 1 that has nothing to do with that of the others."""
    total = 0.0
    for column in range(y.size):
        total += block.whitening[number, column] * y[column]
    return total


def predicted(block: Any, u: Any) -> Any:
    """Return A x + B u of the estimate."""
    estimate = block.estimate
    found = np.empty(estimate.size)
    for row in range(found.size):
        total = 0.0
        for column in range(found.size):
            total += block.transition[row, column] * estimate[column]
        for column in range(u.size):
            total += block.inputs[row, column] * u[column]
        found[row] = total
    return found


def spread(block: Any) -> Any:
    """Return A P A' + Q of the covariance that remains, symmetric to the bit."""
    covariance = block.remaining
    size = covariance.shape[0]
    moved, found = np.empty((size, size)), np.empty((size, size))
    for row in range(size):
        for column in range(size):
            total = 0.0
            for inner in range(size):
                total += block.transition[row, inner] * covariance[inner, column]
            moved[row, column] = total
    for row in range(size):
        for column in range(row, size):
            total = block.Q[row, column]
            for inner in range(size):
                total += moved[row, inner] * block.transition[column, inner]
            found[row, column] = total
            found[column, row] = total
    return found
