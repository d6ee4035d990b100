"""What many runs say about one number, and how well they know it: scipy's intervals, of 95 %."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

CONFIDENCE = 0.95
MOST_RESAMPLED = (
    2000  # values that are resampled; of more of them the mean is normal, and Student's t says the same
)
RESAMPLES = 1999


class IntervalEstimate(NamedTuple):
    """A value and the ends of its confidence interval; NaN where the runs say nothing."""

    value: float
    low: float
    high: float


def estimate_mean(values: NDArray[np.float64]) -> IntervalEstimate:
    """Return the mean of finite values; the interval is by bootstrap, BCa (Efron 1987), equal each time."""
    stats = _stats()
    mean = float(np.mean(values)) if values.size else np.nan
    if values.size < 2:
        return IntervalEstimate(mean, np.nan, np.nan)
    if not np.ptp(values):
        return IntervalEstimate(mean, mean, mean)
    if values.size > MOST_RESAMPLED:
        found = stats.ttest_1samp(values, mean).confidence_interval(CONFIDENCE)
    else:
        found = stats.bootstrap(
            (values,), np.mean, n_resamples=RESAMPLES, batch=100, confidence_level=CONFIDENCE, method="BCa",
            vectorized=True, rng=np.random.default_rng(0),
        ).confidence_interval  # fmt: skip
    return IntervalEstimate(mean, float(found.low), float(found.high))


def estimate_quantile(values: NDArray[np.float64], percent: float) -> IntervalEstimate:
    """Return a quantile of values; the interval holds for any distribution (Conover 1999, between values).

    An end of it is NaN if the values are too few to say.
    """
    if not values.size:
        return IntervalEstimate(np.nan, np.nan, np.nan)
    value = float(np.percentile(values, percent))
    if not 0.0 < percent < 100.0:
        return IntervalEstimate(value, np.nan, np.nan)
    test = _stats().quantile_test(values, q=value, p=percent / 100.0)
    found = test.confidence_interval(CONFIDENCE)
    return IntervalEstimate(value, float(found.low), float(found.high))


def estimate_probability(count: int, runs: int) -> IntervalEstimate:
    """Return the probability of what came ``count`` times in some runs, with Wilson's interval (1927)."""
    if not runs:
        return IntervalEstimate(np.nan, np.nan, np.nan)
    found = _stats().binomtest(count, runs).proportion_ci(CONFIDENCE, method="wilson")
    return IntervalEstimate(count / runs, float(found.low), float(found.high))


def _stats() -> Any:
    from scipy import stats  # a sweep over a grid does not wait for it

    return stats
