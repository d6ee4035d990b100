"""The tap that gives rows of a run to scopes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from quadvis.engine.taps import Tap
from quadvis.scopes.rows import Ticks


class ScopeTap(Tap):
    """Gives the rows of a block at all its ticks to a function of its path, their ticks and the rows."""

    def __init__(self, block: str, feed: Callable[[str, Ticks, Ticks], object]) -> None:
        self.block, self.every = block, 1
        self._feed = feed

    def take(self, tick: int, row: memoryview) -> None:
        """Give a copy of one row."""
        self._feed(self.block, np.array([tick]), np.frombuffer(bytes(row), "<i8").reshape(1, -1))

    def take_all(self, ticks: Ticks, rows: Ticks) -> None:
        """Give many rows together."""
        self._feed(self.block, ticks, rows)
