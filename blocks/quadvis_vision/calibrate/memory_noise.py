"""Linear least squares with errors that are partly new at each instant, and partly last for a while."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

SHARES = (0.0, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9, 0.99)  # of the variance, in errors that last
SMALLEST = 1e-300  # sum of squares, since its logarithm must exist
DURATIONS = 8  # that are tried, from one interval to the whole time


def fit(times: Floats, design: Floats, values: Floats) -> tuple[Floats, Floats]:
    """Return the unknowns (p,) of values (N, m) = design (N, m, p) @ unknowns, and their covariance (p, p).

    Each of the m rows of values has an error of its own: white noise and a first-order Gauss-Markov process,
    all of one size, which may be unknown, and so may be the share and the duration of what lasts. Shares and
    durations on a grid are weighed by their restricted likelihood, so that the covariance contains what the
    data leave open about them. `times` (N,) rise; there must be more values than unknowns. If the design does
    not determine the unknowns, they are 0 and their variances infinite.

    Source: Harville, Maximum likelihood approaches to variance component estimation (1977); the Kalman filter
    makes the errors white.
    """
    count, unknowns = values.size, design.shape[2]
    if np.linalg.matrix_rank(design.reshape(count, unknowns)) < unknowns:
        return np.zeros(unknowns), np.diag(np.full(unknowns, np.inf))
    share, duration = _grid(times)
    white, volume = whitened(times, np.concatenate((design, values[:, :, None]), axis=2), share, duration)
    tops: list[float] = []
    means, spreads = [], []
    for rows, log_volume in zip(white, volume, strict=True):
        upper = np.asarray(np.linalg.qr(rows.reshape(count, unknowns + 1), mode="r"))
        inverse = np.linalg.inv(upper[:unknowns, :unknowns])
        squares = max(float(upper[unknowns, unknowns]) ** 2, SMALLEST)
        free = count - unknowns
        means.append(inverse @ upper[:unknowns, unknowns])
        spreads.append(inverse @ inverse.T * squares / free)
        level = np.log(np.abs(np.diag(upper)[:unknowns])).sum()
        tops.append(-0.5 * (free * np.log(squares) + log_volume) - level)
    weights = np.exp(np.array(tops) - max(tops))
    weights /= weights.sum()
    mean = weights @ np.array(means)
    off = np.array(means) - mean
    covariance = np.einsum("g,gij->ij", weights, np.array(spreads) + off[:, :, None] * off[:, None, :])
    return mean, covariance


def _grid(times: Floats) -> tuple[Floats, Floats]:
    """Return shares (g,) and durations (g,) in the unit of times."""
    shortest, longest = float(np.median(np.diff(times))), float(times[-1] - times[0])
    durations = np.geomspace(shortest, longest, DURATIONS)
    pairs = [(0.0, shortest)] + [(share, each) for share in SHARES[1:] for each in durations]
    return np.array([pair[0] for pair in pairs]), np.array([pair[1] for pair in pairs])


def whitened(times: Floats, columns: Floats, share: Floats, duration: Floats) -> tuple[Floats, Floats]:
    """Return the columns (N, m, c) with white errors of variance 1, (g, N, m, c), and log determinants (g,).

    A Kalman filter for the error of variance 1; all filters, one for each share and duration, run together.
    """
    found = np.empty((len(share), *columns.shape))
    volume = np.zeros(len(share))
    kept, variance = np.zeros((len(share), *columns.shape[1:])), share.copy()
    for index, row in enumerate(columns):
        if index:
            decay = np.exp(-(times[index] - times[index - 1]) / duration)
            kept *= decay[:, None, None]
            variance = decay**2 * variance + (1 - decay**2) * share
        total = variance + 1 - share
        news = row - kept
        found[:, index] = news / np.sqrt(total)[:, None, None]
        volume += columns.shape[1] * np.log(total)
        kept += news * (variance / total)[:, None, None]
        variance = variance * (1 - share) / total
    return found, volume
