"""A log of bounded length: of a long run it has the newest rows, in two files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import RunError
from quadvis.output.log import LogWriter
from quadvis.output.recording import Buffer, RecordedBlock, Slots

BEFORE = ".before"  # in the name of the file with the rows before those of the newest
WRAPS = "wraps"  # a fact of a log that lacks the beginning of its run: how often it began anew


def before(path: Path) -> Path:
    """Return the path of the part of a log that comes before its newest one."""
    return path.with_name(f"{path.stem}{BEFORE}{path.suffix}")


class WrappedLog:
    """Writes rows as a `LogWriter`; once it has ``span`` (ns) of the run, it begins anew.

    The file is then the part `before`, in place of an older one. So the two have the newest rows of at least
    one span and at most two. ``wraps`` counts how often it began anew. If the disk refuses a new file, the
    run goes on without a log, and ``loss`` says so.
    """

    def __init__(
        self, path: str | Path, blocks: Sequence[RecordedBlock], metadata: Mapping[str, str], span: int
    ) -> None:
        self.path = Path(path)
        self.wraps = 0
        self._blocks, self._metadata, self._span = tuple(blocks), dict(metadata), span
        self._first: int | None = None  # stamps of the present file
        self._latest = 0
        self._loss = ""
        before(self.path).unlink(missing_ok=True)
        self._writer: LogWriter | None = LogWriter(self.path, self._blocks, self._metadata)

    def write(self, block: int, time: int, row: Buffer) -> None:
        """Write one row, see `LogWriter.write`."""
        if self._writer is not None:
            self._reach(time, time)
            self._writer.write(block, time, row)

    def write_rows(self, block: int, times: NDArray[np.int64], rows: Slots) -> None:
        """Write N rows, see `LogWriter.write_rows`."""
        if self._writer is not None and len(times):
            self._reach(int(times[0]), int(times[-1]))
            self._writer.write_rows(block, times, rows)

    def _reach(self, first: int, last: int) -> None:
        self._first = first if self._first is None else min(self._first, first)
        self._latest = max(self._latest, last)

    def write_change(self, tick: int, path: str, name: str, value: Any) -> None:
        """Write that a parameter took a value, see `LogWriter.write_change`."""
        if self._writer is not None:
            self._writer.write_change(tick, path, name, value)

    def flush_late(self) -> None:
        """Hand rows on if it is time; begin anew if the file is long enough. No block waits with rows now."""
        if self._writer is None:
            return
        self._writer.flush_late()
        if self._first is not None and self._latest - self._first >= self._span:
            self._begin_anew()

    def _begin_anew(self) -> None:
        assert self._writer is not None
        self._writer.close({"stopped": "the log went on in another file"})
        self._loss = self._loss or self._writer.loss
        self.wraps += 1
        self._first = None
        try:
            self.path.replace(before(self.path))
            self._writer = LogWriter(self.path, self._blocks, self._metadata | {WRAPS: str(self.wraps)})
        except (OSError, RunError) as error:
            self._writer, self._loss = None, f"the log has ended: {error}"

    @property
    def loss(self) -> str:
        """A sentence about rows that the log lacks though they are new enough; "" if there are none."""
        return self._loss or (self._writer.loss if self._writer is not None else "")

    def close(self, summary: Mapping[str, str] | None = None) -> None:
        """End the newest file with the outcome of the run."""
        if self._writer is not None:
            self._writer.close(summary)

    def __enter__(self) -> Self:
        """Return the writer itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file, as a `LogWriter` does."""
        if self._writer is not None:
            self._writer.__exit__(kind, error, trace)


RunLog = LogWriter | WrappedLog  # what takes the rows of a run
