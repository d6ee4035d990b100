"""What differs between the signals of two logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadvis.output.comparison import BlockComparison, SignalDifference, placed
from quadvis.output.recording import RecordedBlock, RecordedPort, Recording

Whole = NDArray[np.int64]


@dataclass(frozen=True)
class DifferentSignal:
    """A signal that differs between two logs; ``time`` is that of its first different row (s)."""

    difference: SignalDifference
    time: float


@dataclass(frozen=True)
class SignalChanges:
    """``different`` are in the order of their times; ``unlike`` have other types, shapes or times."""

    compared: int = 0
    different: tuple[DifferentSignal, ...] = ()
    only_old: tuple[str, ...] = ()
    only_new: tuple[str, ...] = ()
    unlike: tuple[tuple[str, str], ...] = ()  # name, and what is not alike

    def __bool__(self) -> bool:
        return bool(self.different or self.only_old or self.only_new or self.unlike)


def compare_signals(old: Recording, new: Recording) -> SignalChanges:
    """Return what differs between the signals of two recordings, at the times that both have."""
    before, after = _signals(old), _signals(new)
    different, unlike = [], []
    both = [name for name in before if name in after]
    for name in both:
        (block, start), (other, start_new) = before[name], after[name]
        (port,), (other_port,) = block.ports, other.ports
        if port[:3] != other_port[:3]:
            unlike.append((name, f"{_form(port)}, then {_form(other_port)}"))
            continue
        stamps, rows = old.arrays(block.path)
        stamps_new, rows_new = new.arrays(other.path)
        at, at_new = _common(stamps, stamps_new)
        missing = len(stamps) - len(at), len(stamps_new) - len(at_new)
        if any(missing):
            unlike.append((name, f"{missing[0]} rows only in the first, {missing[1]} only in the second"))
        comparison = BlockComparison(block)
        comparison.compare(
            rows[at, start : start + port.size], rows_new[at_new, start_new : start_new + port.size]
        )
        for each in comparison.differences():
            different.append(DifferentSignal(each, float(stamps[at[each.row]] / 1e9)))
    return SignalChanges(
        len(both),
        tuple(sorted(different, key=lambda each: each.time)),
        tuple(name for name in before if name not in after),
        tuple(name for name in after if name not in before),
        tuple(unlike),
    )


def _signals(recording: Recording) -> dict[str, tuple[RecordedBlock, int]]:
    """Return each signal as a block of one port, with its first slot in the rows of its block."""
    return {
        block.signal(port): (block._replace(ports=(port,)), start)
        for block in recording.blocks
        for port, start in placed(block)
    }


def _form(port: RecordedPort) -> str:
    return f"{port.type}{list(port.shape) if port.shape else ''}"


def _common(old: Whole, new: Whole) -> tuple[Whole, Whole]:
    """Return the numbers of the rows that have the same stamps, in their order."""
    if np.array_equal(old, new):
        every = np.arange(len(old))
        return every, every
    _, at, at_new = np.intersect1d(old, new, return_indices=True)
    return at, at_new
