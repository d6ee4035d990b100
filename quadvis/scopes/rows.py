"""Rows on their way to scopes: what has come of each block, and samples from what is settled."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.output.recording import SLOT_TYPES
from quadvis.scopes.source import ScopePlan

Ticks = NDArray[np.int64]
Samples = NDArray[np.float64]
NO_TICKS = np.zeros(0, np.int64)


class SettledRows(NamedTuple):
    """The rows of a block that have been settled together: ticks (N,), rows (N, slots).

    ``before`` (1, slots) is the newest row before them; it has no rows if there was none.
    """

    ticks: Ticks
    rows: Ticks
    before: Ticks


class BlockRows:
    """The rows of one block that are not settled yet, and the newest one that is."""

    def __init__(self) -> None:
        self._pieces: list[tuple[Ticks, Ticks]] = []
        self._last = -1  # the latest tick that has come
        self._newest: Ticks | None = None

    def feed(self, ticks: Ticks, rows: Ticks, settled: int) -> None:
        """Take rows (N, slots) of ticks (N,) in ascending order, all of them from tick ``settled`` on."""
        if not len(ticks):
            return
        if ticks[0] < settled or ticks[0] <= self._last or (ticks[1:] <= ticks[:-1]).any():
            raise ValueError(f"rows of the ticks {ticks[0]} to {ticks[-1]} come too late, or in no order")
        self._pieces.append((ticks, rows))
        self._last = int(ticks[-1])

    def settle(self, tick: int) -> SettledRows | None:
        """Return all rows before a tick; None if there are none and none before."""
        whole = []
        while self._pieces and int(self._pieces[0][0][-1]) < tick:
            whole.append(self._pieces.pop(0))
        if self._pieces and int(self._pieces[0][0][0]) < tick:
            ticks, rows = self._pieces[0]
            cut = int(np.searchsorted(ticks, tick))
            whole.append((ticks[:cut], rows[:cut]))
            self._pieces[0] = ticks[cut:], rows[cut:]
        before = self._newest
        if not whole:
            return None if before is None else SettledRows(NO_TICKS, before[:0], before)
        ticks, rows = whole[0] if len(whole) == 1 else map(np.concatenate, zip(*whole, strict=True))
        self._newest = rows[-1:].copy()
        return SettledRows(ticks, rows, rows[:0] if before is None else before)


class Sampler:
    """Takes the samples of a scope from rows: at the ticks of its rate, each with the newest values."""

    def __init__(self, plan: ScopePlan) -> None:
        self.plan = plan
        places: dict[tuple[str, str], list[tuple[int, int]]] = {}
        for column, trace in enumerate(plan.columns):
            places.setdefault((trace.block, trace.type), []).append((column, trace.slot))
        self._width = len(plan.columns)
        self._parts = [
            (block, kind, _indices(column for column, _ in found), _indices(slot for _, slot in found))
            for (block, kind), found in places.items()
        ]

    def take(self, settled: Mapping[str, SettledRows]) -> tuple[Ticks, Samples]:
        """Return the ticks (N,) and the samples (N, columns); NaN where a block has had no row yet."""
        grid = {block: settled[block].ticks for block in self.plan.grid if block in settled}
        ticks, together = _union(list(grid.values()))
        samples = np.empty((len(ticks), self._width))
        if not len(ticks):
            return ticks, samples
        for block, kind, columns, slots in self._parts:
            found = settled.get(block)
            if found is None:
                samples[:, columns] = np.nan
            elif together and block in grid:
                samples[:, columns] = _floats(found.rows[:, slots], kind)
            else:
                samples[:, columns] = _newest(found, kind, slots, ticks)
        return ticks, samples


def _newest(found: SettledRows, kind: str, slots: slice | list[int], ticks: Ticks) -> Samples:
    """Return the values (N, columns) of the newest row at or before each tick."""
    values = _floats(found.rows[:, slots], kind)
    first = _floats(found.before[:, slots], kind)
    if not len(first):
        first = np.full((1, values.shape[1]), np.nan)
    newest: Samples = np.concatenate((first, values))[np.searchsorted(found.ticks, ticks, "right")]
    return newest


def _floats(slots: Ticks, kind: str) -> Samples:
    """Return values of slots (N, columns) as numbers."""
    values = np.ascontiguousarray(slots).view(SLOT_TYPES[kind])
    return (values != 0 if kind == "bool" else values).astype(np.float64, copy=False)


def _indices(numbers: Iterable[int]) -> slice | list[int]:
    """Return ascending neighbours as a slice, since numpy takes one sooner than a list."""
    found = list(numbers)
    neighbours = found == list(range(found[0], found[0] + len(found)))
    return slice(found[0], found[0] + len(found)) if neighbours else found


def _union(ticks: Sequence[Ticks]) -> tuple[Ticks, bool]:
    """Return all ticks in ascending order, each once, and whether each array has them all.

    Blocks of one task have the same ticks as a rule.
    """
    first = ticks[0] if ticks else NO_TICKS
    if all(len(other) == len(first) and (other == first).all() for other in ticks[1:]):
        return first, True
    return np.unique(np.concatenate(ticks)), False
