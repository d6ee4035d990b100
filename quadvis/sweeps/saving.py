"""The file of a sweep's table while runs finish: it grows by rows as they come, and is sorted at the end."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from quadvis.errors import QuadvisError, quoted
from quadvis.errors.caller import as_given
from quadvis.machine.files import Claim
from quadvis.sweeps.collection import Collection, TableMaker
from quadvis.sweeps.jobs import Jobs
from quadvis.sweeps.stop_rule import StopRule
from quadvis.sweeps.table import FAILURE, HASH, PASSED, WALL, Table, read_rows, table_kind
from quadvis.sweeps.worker import Job, Quantity, Row, diagram_of

SAVE = 1.0  # s between two writings of finished runs
SHARE = 10  # times what the last one took: so long is the pause after it, at least


class Saving:
    """Collects rows in memory, and writes them to a file, if there is one: as they come, then sorted."""

    def __init__(
        self,
        make: TableMaker,
        rule: StopRule | None,
        path: Path | None,
        timings: bool,
        inputs: Iterable[Path],
    ) -> None:
        self.collection = Collection(make, rule)
        self.path, self.timings = path, timings
        self.claim = None if path is None else Claim(path, table_kind(path), inputs)
        self.saved = 0  # rows
        self.pause = WritingPause()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.claim is not None:
            with closing(self.claim):
                if self.collection.rows:
                    self.claim.write(self._content(self.collection.table()))

    def jobs(self, jobs: Jobs, folder: Path | None, engine: str, resume: bool) -> Iterator[Job]:
        """Yield the jobs of a sweep; with ``resume`` without those whose rows the file has already."""
        earlier = {}
        if resume and self.path is not None and self.path.stat().st_size:
            earlier = earlier_rows(self.path, self.collection.make.quantities)
        wanted = jobs.jobs(range(jobs.design.runs), folder, engine)
        return self._not_known(wanted, earlier) if earlier else wanted

    def _not_known(self, jobs: Iterable[Job], earlier: Mapping[str, Row]) -> Iterator[Job]:
        """Take over the rows of an earlier table with the hash of a job's diagram; yield the other jobs."""
        for job in jobs:
            try:
                row = earlier.get(diagram_of(job).hash)
            except QuadvisError:
                row = None  # the run will report the error
            if row is None:
                yield job
            else:
                self.collection.add(replace(row, index=job.index))
            if self.collection.enough:
                return

    def table(self) -> Table:
        """Return the table of all rows."""
        return self.collection.table()

    def now_and_then(self) -> None:
        """Append new rows if the last time is long enough ago; after `kill -9` these rows are left."""
        count = len(self.collection.rows)
        if self.claim is None or count == self.saved or self.pause.is_early:
            return
        self.pause.begin()
        if self.saved and self.claim.path.suffix == ".csv":
            self.claim.append(self._content(self.collection.table(self.saved), head=False))
        else:
            self.claim.write(self._content(self.collection.table()))
        self.saved = count
        self.pause.finish()

    def _content(self, table: Table, head: bool = True) -> bytes:
        assert self.path is not None
        return table.content(self.path.suffix, timings=self.timings, head=head)


class WritingPause:
    """When it is time to write again."""

    def __init__(self) -> None:
        self._began = self._finished = time.monotonic()

    @property
    def is_early(self) -> bool:
        """True until `SAVE` has passed, or longer after a write that took long."""
        pause = max(SAVE, SHARE * (self._finished - self._began))
        return time.monotonic() - self._finished < pause

    def begin(self) -> None:
        """Note that a write begins."""
        self._began = time.monotonic()

    def finish(self) -> None:
        """Note that it is done."""
        self._finished = time.monotonic()


def earlier_rows(path: Path, quantities: Sequence[Quantity]) -> dict[str, Row]:
    """Return the rows of an earlier table by hash, without runs that stopped with an error.

    QuadvisError if the file is no table of such a sweep.
    """
    rows = (row_of(cells, path, quantities) for cells in read_rows(path))
    return {row.hash: row for row in rows if not row.failure}


def row_of(cells: Mapping[str, Any], path: Path, quantities: Sequence[Quantity], index: int = 0) -> Row:
    """Return the row of some cells of a file; QuadvisError if they are not those of such a sweep."""
    names = (HASH, FAILURE, PASSED, *(quantity.column for quantity in quantities))
    if any(name not in cells for name in names):
        problem = f"cannot go on with '{path}': it is not a table of this sweep"
        raise QuadvisError(f"{problem}; leave {as_given('--resume', 'resume')} out to begin anew")
    if cells[FAILURE]:
        return Row(index, cells[HASH], failure=cells[FAILURE])
    numbers = tuple(_number(cells[quantity.column]) for quantity in quantities)
    units = tuple(quantity.unit for quantity in quantities)
    return Row(
        index, cells[HASH], units, numbers, cells[PASSED] in (True, "true"), wall=_number(cells.get(WALL))
    )


def _number(cell: Any) -> float:
    try:
        return float(cell) if cell not in (None, "") else math.nan
    except ValueError:
        raise QuadvisError(f"the table holds {quoted(cell)} in place of a number") from None
