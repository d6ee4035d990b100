"""Packages: the samples that a scope hands on together."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Package:
    """N samples of the k traces of a scope.

    ``scope`` is its number, ``sequence`` counts its packages from 0. ``ticks`` (N,) are base ticks, ``times``
    (N,) in s, ``samples`` (N, k) in the ``units`` of the traces ``names``; NaN is a value that was not there
    yet. ``trigger`` is the index of the sample at the trigger: below zero if it lies before the first one,
    None in FreeRun. ``lost`` counts the ticks of the scope that the run has left out between the first and
    the last sample, in FreeRun from the last sample of the package before.
    """

    scope: int
    sequence: int
    ticks: NDArray[np.int64]
    times: NDArray[np.float64]
    samples: NDArray[np.float64]
    names: tuple[str, ...]
    units: tuple[str, ...]
    trigger: int | None = None
    lost: int = 0

    @property
    def first(self) -> int:
        """The tick of the first sample."""
        return int(self.ticks[0])

    def __len__(self) -> int:
        return len(self.ticks)

    def followed_by(self, newer: Package) -> Package:
        """Return the samples of a newer package, and as many before them as make a package of this length."""
        begin = len(newer)
        return replace(
            newer,
            ticks=np.concatenate((self.ticks, newer.ticks))[begin:],
            times=np.concatenate((self.times, newer.times))[begin:],
            samples=np.concatenate((self.samples, newer.samples))[begin:],
            trigger=None,
            lost=self.lost + newer.lost,
        )
