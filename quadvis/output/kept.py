"""What becomes of the rows of a run: some are judged and forgotten, some kept, the others wait in the log."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping, Sequence
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted
from quadvis.output.log_reader import read_log
from quadvis.output.recording import Channel, Recording, Slots

ALL = "*"
PIECE = 1 << 16  # bytes of rows that are judged at a time


class Judge(Protocol):
    """What judges a run while it goes on."""

    @property
    def names(self) -> Iterable[str]:
        """The signals that it looks at."""

    def take(self, name: str, number: int, rows: NDArray[Any]) -> None:
        """Take rows of a signal; ``number`` counts those before, from the first row of the run."""


class RowJudge:
    """Hands the rows of a block to what judges them, some at a time."""

    def __init__(self, channel: Channel, judging: Judge) -> None:
        self._channel, self._judging = channel, judging
        self._waiting = bytearray()
        self._first = self._count = 0  # number of the first row that waits, and how many do
        self._fields = []
        start = 0
        for field in channel.fields:
            if channel.signal(field) in judging.names:
                self._fields.append((channel.signal(field), field, start))
            start += field.size

    @property
    def names(self) -> list[str]:
        """The signals of the block that are judged."""
        return [name for name, _, _ in self._fields]

    def __call__(self, stamp: int, row: bytes) -> None:
        """Take the next row."""
        self._waiting += row
        self._count += 1
        if len(self._waiting) >= PIECE:
            self.flush()

    def flush(self) -> None:
        """Hand on what waits."""
        slots = self._channel.slots(bytes(self._waiting), self._count)
        for name, field, start in self._fields:
            self._judging.take(name, self._first, field.rows(slots, start))
        self._first += self._count
        self._waiting.clear()
        self._count = 0


class RunSignals(Recording):
    """The signals of a run: those that a pattern names are in memory, the others are read from its log."""

    def __init__(
        self, channels: Sequence[Channel], ports: Mapping[str, str], patterns: Iterable[str]
    ) -> None:
        super().__init__(channels, ports)
        self.kept: set[int] = set()
        for pattern in patterns:
            self.kept |= self._named(pattern)
        self._log: Path | None = None
        self._loss = ""
        self._file: tuple[int, ...] = ()
        self._read: Recording | None = None

    def _named(self, pattern: str) -> set[int]:
        """Return the blocks that a pattern names by a signal, by themselves, or by the name of one signal."""
        if pattern in self:
            return {self._find(pattern)[0]}
        found = {
            index for name, (index, _, _) in self._signals.items()
            if fnmatchcase(name, pattern) or fnmatchcase(name.rpartition(".")[0], pattern)
        }  # fmt: skip
        if not found and pattern != ALL:
            self._find(pattern)  # says what is wrong with it
        return found

    def written(self, log: Path, loss: str) -> None:
        """Say that the rows are in a log that is finished now, and what it lacks."""
        self._log, self._loss = log, loss
        self._file = _identity(log)

    def _arrays(self, channel: int) -> tuple[NDArray[np.int64], Slots]:
        if channel in self.kept:
            return super()._arrays(channel)
        path = self.channels[channel].path.strip("/")
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
            self._read = read_log(self._log)
        return self._read.arrays(self.channels[channel].path)


def _identity(path: Path) -> tuple[int, ...]:
    """Return what changes when a file is written again; nothing if there is none."""
    try:
        found = os.stat(path)
    except OSError:
        return ()
    return found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns
