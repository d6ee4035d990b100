"""What a scope collects for a package, and where its trigger's signal crosses a level."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadvis.scopes.properties import FALLING, RISING
from quadvis.scopes.ring import SampleRing
from quadvis.scopes.rows import Samples, Ticks


class SampleBuffer:
    """Collects ``count`` samples of ``width`` traces: every ``step``-th row of a scope from ``first`` on."""

    def __init__(self, first: int, count: int, step: int, width: int) -> None:
        self.first, self.step = first, step
        self.last = first + (count - 1) * step  # the row of the last sample
        self.filled = 0  # samples that are there
        self._ticks = np.empty(count, np.int64)
        self._samples = np.empty((count, width))

    def collect(self, end: int, base: int, ticks: Ticks, samples: Samples, ring: SampleRing) -> None:
        """Take samples of rows before ``end``: those before ``base`` from the ring, then from new rows.

        ``ticks`` (N,) and ``samples`` (N, columns) are those of the row ``base`` and of the next ones.
        """
        first = self.first + self.filled * self.step
        rows = range(first, min(end, self.last + 1), self.step)
        old = rows[: len(range(first, min(base, rows.stop), self.step))]
        if old:
            self._keep(*ring.take(old))
        new = rows[len(old) :]
        if new:
            places = slice(new.start - base, new.stop - base, self.step)
            self._keep(ticks[places], samples[places, : self._samples.shape[1]])

    def samples(self, count: int) -> tuple[Ticks, Samples]:
        """Return the ticks and the values of the first samples."""
        return self._ticks[:count], self._samples[:count]

    def _keep(self, ticks: Ticks, samples: Samples) -> None:
        part = slice(self.filled, self.filled + len(ticks))
        self._ticks[part], self._samples[part] = ticks, samples
        self.filled = part.stop


def crossings(before: float, values: Samples, level: float, slope: str) -> NDArray[np.int64]:
    """Return where values (N,) reach a level from the other side; ``before`` is the value before them."""
    old = np.concatenate(([before], values[:-1])) if len(values) else values
    rising, falling = (old < level) & (values >= level), (old > level) & (values <= level)
    return np.flatnonzero({RISING: rising, FALLING: falling}.get(slope, rising | falling))
