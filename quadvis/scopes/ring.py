"""The newest rows of a scope, kept for the samples before a trigger."""

from __future__ import annotations

import numpy as np

from quadvis.scopes.rows import Samples, Ticks


class SampleRing:
    """Keeps the newest ``room`` rows of a scope; rows are counted from 0."""

    def __init__(self, room: int, width: int) -> None:
        self._room = room
        self._ticks = np.zeros(room, np.int64)
        self._samples = np.zeros((room, width))

    def put(self, first: int, ticks: Ticks, samples: Samples) -> None:
        """Keep rows; ``first`` is the number of the first one."""
        skipped = max(0, len(ticks) - self._room)
        start = (first + skipped) % self._room if self._room else 0
        ticks, samples = ticks[skipped:], samples[skipped:]
        ahead = min(len(ticks), self._room - start)
        for ring, new in ((self._ticks, ticks), (self._samples, samples)):
            ring[start : start + ahead] = new[:ahead]
            ring[: len(new) - ahead] = new[ahead:]

    def take(self, rows: range) -> tuple[Ticks, Samples]:
        """Return rows by their numbers; they must be among the newest."""
        places = np.arange(rows.start, rows.stop, rows.step) % self._room
        return self._ticks[places], self._samples[places]
