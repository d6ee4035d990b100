"""Rows that nobody has taken since the supervisor has died: their application adds them to the log.

A ring keeps some 2 s of rows, and those that were taken stay in it until others need their places; so it has
what the supervisor had no time to write, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from typing import NamedTuple

import numpy as np

from quadvis.output.stretch import stamps_of
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.ring import Words
from quadvis.realtime.streams import RowStream


class LogTopics(NamedTuple):
    """The path of a run's log, and the topics of what the loops note, by computer."""

    path: str
    left_out: Mapping[str, str]
    releases: Mapping[str, str]


class LogTail(NamedTuple):
    """Where the rows of an application belong.

    ``streams`` has the topics of the blocks of each stream, ``left_out`` and ``releases`` are those of
    what its loop has noted; "" stands for what is not logged.
    """

    path: str
    streams: tuple[tuple[str, ...], ...]
    left_out: str = ""
    releases: str = ""

    def add(self, streams: Sequence[RowStream], shared: SharedMemory, tick: Fraction) -> None:
        """Add what the log lacks, if it can be had; ``tick`` is the period of a tick (s).

        Nobody is left to whom a failure could be reported: the log is then as its writer has left it.
        """
        from quadvis.output.log_tail import add_tail

        rows = {
            topic: (stamps_of(ticks, tick), np.ascontiguousarray(slots))
            for topic, ticks, slots in self._rows(streams, shared)
            if topic and len(ticks)
        }
        with suppress(OSError, ValueError, MemoryError):
            add_tail(self.path, rows)

    def _rows(self, streams: Sequence[RowStream], shared: SharedMemory) -> Iterator[tuple[str, Words, Words]]:
        """Yield topics, ticks and rows."""
        for stream, ring, topics in zip(streams, shared.rings, self.streams, strict=True):
            records, start = ring.kept(), 1
            for topic, size in zip(topics, stream.sizes, strict=True):
                yield topic, records[:, 0], records[:, start : start + size]
                start += size
        left_out, releases = shared.notes.left_out.kept(), shared.notes.releases.kept()
        yield self.left_out, left_out[:, 0], left_out
        yield self.releases, np.maximum.accumulate(releases[:, 1]), releases
