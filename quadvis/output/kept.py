"""The rows of a run: some are judged and dropped, some kept in memory, the others read from the log."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.output.recording import RecordedBlock, Recording, Slots

ALL = "*"
PIECE = 1 << 16  # bytes of rows that are judged together


class Judge(Protocol):
    """A judge of a run, which takes rows as they come."""

    @property
    def names(self) -> Iterable[str]:
        """The signals that are judged."""

    def take(self, name: str, number: int, rows: NDArray[Any]) -> None:
        """Take rows of a signal; ``number`` is the number of rows before them since the start of the run."""

    def miss(self, name: str, number: int, count: int) -> None:
        """Note that ``count`` rows do not exist, in place of taking them."""


class RowJudge:
    """Collects the rows of a block and hands them to the judging, many at a time."""

    def __init__(self, block: RecordedBlock, judging: Judge) -> None:
        self._block, self._judging = block, judging
        self._waiting = bytearray()
        self._first = self._count = 0  # number of the first waiting row, and count of waiting rows
        self._ports = []
        start = 0
        for port in block.ports:
            if block.signal(port) in judging.names:
                self._ports.append((block.signal(port), port, start))
            start += port.size

    @property
    def names(self) -> list[str]:
        """The signals of the block that are judged."""
        return [name for name, _, _ in self._ports]

    def take(self, stamp: int, row: bytes) -> None:
        """Take the next row."""
        self._waiting += row
        self._count += 1
        if len(self._waiting) >= PIECE:
            self.flush()

    def take_all(self, stamps: Slots, rows: Slots) -> None:
        """Take the next N rows (N, slots), in pieces that do not depend on how many come together."""
        room = max(1, -(-PIECE // self._block.size))  # rows of a piece
        done = 0
        while done < len(rows):
            some = rows[done : done + room - self._count]
            self._waiting += some.tobytes()
            self._count += len(some)
            done += len(some)
            if self._count >= room:
                self.flush()

    def miss(self, count: int) -> None:
        """Note that the next rows do not exist: a real-time run has left out their ticks."""
        self.flush()
        for name, _, _ in self._ports:
            self._judging.miss(name, self._first, count)
        self._first += count

    def flush(self) -> None:
        """Hand on the waiting rows."""
        slots = self._block.slots(bytes(self._waiting), self._count)
        for name, port, start in self._ports:
            self._judging.take(name, self._first, port.rows(slots, start))
        self._first += self._count
        self._waiting.clear()
        self._count = 0


class RunSignals(Recording):
    """The signals of a run: signals that a pattern names are in memory, the others are read from the log."""

    def __init__(
        self, blocks: Sequence[RecordedBlock], ports: Mapping[str, str], patterns: Iterable[str]
    ) -> None:
        super().__init__(blocks, ports)
        self.kept: set[int] = set()
        for pattern in patterns:
            self.kept |= self._named(pattern)
        self._log: Path | None = None
        self._loss = ""
        self._file: tuple[int, ...] = ()
        self._read: Recording | None = None

    def _named(self, pattern: str) -> set[int]:
        """Return the blocks that a pattern names by their signals, by themselves, or by one signal."""
        if pattern in self:
            return {self.find(pattern)[0]}
        found = {
            index for name, (index, _, _) in self._signals.items()
            if fnmatchcase(name, pattern) or fnmatchcase(name.rpartition(".")[0], pattern)
        }  # fmt: skip
        if not found and pattern != ALL:
            self.find(pattern)  # raises an error that says what is wrong with the pattern
        return found

    def written(self, log: Path, loss: str) -> None:
        """Note that the finished log holds the rows, and what it lacks."""
        self._log, self._loss = log, loss
        self._file = _identity(log)

    def _arrays(self, block: int) -> tuple[NDArray[np.int64], Slots]:
        if block in self.kept:
            return super()._arrays(block)
        path = self.blocks[block].path.strip("/")
        if self._log is None:
            remedy = f"name it, as in keep=[{quoted(f'{path}.*')}], or write a log"
            raise QuadvisError(f"the rows of {quoted(path)} were not kept; {remedy}")
        if self._loss:
            raise QuadvisError(f"the rows of {quoted(path)} were not kept, and {self._loss}")
        if self._read is None:
            if _identity(self._log) != self._file:
                problem = f"the log '{self._log}' of this run is not what it was"
                raise QuadvisError(
                    f"{problem}; keep the rows of {quoted(path)} in memory, or the log as it is"
                )
            from quadvis.output.log_reader import read_log  # most runs have no need of it

            self._read = read_log(self._log)
        return self._read.arrays(self.blocks[block].path)


def _identity(path: Path) -> tuple[int, ...]:
    """Return numbers of a file that change when it is written again; () if it does not exist."""
    try:
        found = os.stat(path)
    except OSError:
        return ()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
