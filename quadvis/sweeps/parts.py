"""The table of a large sweep: a folder of Parquet files, of which only the rows at work are in memory.

A part has a fixed number of rows in the order of the design, and is written once these are finished. Those
that are finished before their turn stand in a file of their own, whose name pandas, Arrow and Spark pass
over.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis.errors.caller import as_given
from quadvis.machine.files import Claim, reason, write_output
from quadvis.sweeps.collection import Collection, TableMaker
from quadvis.sweeps.jobs import Jobs
from quadvis.sweeps.saving import WritingPause, row_of
from quadvis.sweeps.stop_rule import StopRule
from quadvis.sweeps.table import KINDS, WALL, Table, parquet, pyarrow_library, read_rows
from quadvis.sweeps.worker import Job, Row

PART = 10_000  # rows of a file
UNFINISHED = "_unfinished.parquet"
ROW, KEY = "row", "quadvis.sweep"  # the column of a row's number in that file; a fact in the metadata of all
KIND = KINDS[".parquet"]


class PartedSaving:
    """Writes rows to a folder part by part, and keeps those in memory whose part is not complete."""

    def __init__(
        self,
        make: TableMaker,
        rule: StopRule | None,
        folder: Path,
        timings: bool,
        inputs: Iterable[Path],
        key: str,
    ) -> None:
        """Take the folder, which is made if it is missing; ``key`` is equal for sweeps alone with equal rows.

        QuadvisError if it cannot be written, or holds other files.
        """
        pyarrow_library()
        self.collection = Collection(make, rule)
        self.folder, self.timings, self.inputs, self.key = folder, timings, list(inputs), key
        _make_folder(folder)
        self.old = sorted(folder.glob("part-*.parquet"))
        self.claim = Claim(folder / UNFINISHED, KIND, self.inputs)
        self.written = 0  # parts
        self.changed, self.pause = 0, WritingPause()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        try:
            if kind is not None and self.collection.rows:
                self._keep()
            elif self.collection.rows:
                self._write(self.collection.rows)
        finally:
            self.claim.close()
        if kind is None:
            for path in (self.folder / UNFINISHED, *self.old[self.written :]):
                path.unlink(missing_ok=True)

    def jobs(self, jobs: Jobs, folder: Path | None, engine: str, resume: bool) -> Iterator[Job]:
        """Yield the jobs of a sweep; with ``resume`` without those whose rows the folder has already.

        QuadvisError if the folder is that of another sweep.
        """
        if resume:
            for path in (*self.old, self.folder / UNFINISHED):
                self._refuse_other(path)
            for row in self._rows(self.folder / UNFINISHED, None):
                self.collection.add(row)
        return jobs.jobs(self._missing(jobs.design.runs, resume), folder, engine)

    def _missing(self, runs: int, resume: bool) -> Iterator[int]:
        """Yield the rows that are to be run; take over those of earlier parts, one part after the other."""
        for first in range(0, runs, PART):
            known = set(self.collection.rows)
            for row in self._rows(self._part(first // PART), first) if resume else ():
                if row.index < runs and row.index not in known:
                    known.add(row.index)
                    self.collection.add(row)
            self.write_parts()
            for row_number in range(first, min(first + PART, runs)):
                if self.collection.enough:
                    return
                if row_number not in known:
                    yield row_number

    def _part(self, number: int) -> Path:
        return self.folder / f"part-{number:05}.parquet"

    def _rows(self, path: Path, first: int | None) -> Iterator[Row]:
        """Yield the rows of a file that need not be run again."""
        if path.is_file() and path.stat().st_size:
            for number, cells in enumerate(read_rows(path)):
                index = cells[ROW] if first is None else first + number
                row = row_of(cells, path, self.collection.make.quantities, index)
                if not row.failure:
                    yield row

    def _refuse_other(self, path: Path) -> None:
        if not path.is_file() or not path.stat().st_size:
            return
        try:
            facts: Mapping[bytes, bytes] = pyarrow_library().parquet.read_schema(path).metadata or {}
        except (OSError, ValueError) as error:
            raise QuadvisError(f"cannot read the table '{path}': {str(error).splitlines()[0]}") from error
        if facts.get(KEY.encode()) != self.key.encode():
            problem = f"cannot go on with '{self.folder}': it is of another diagram, design or seed"
            raise QuadvisError(f"{problem}; leave {as_given('--resume', 'resume')} out to begin anew")

    def now_and_then(self) -> None:
        """Write complete parts, and now and then the rows of others; after `kill -9` these rows are left."""
        self.write_parts()
        if self.collection.finished != self.changed and not self.pause.is_early:
            self._keep()

    def write_parts(self) -> None:
        """Write the parts that are complete, and forget their rows."""
        while self.collection.known >= (self.written + 1) * PART:
            part = range(self.written * PART, (self.written + 1) * PART)
            self._write(part)
            for index in part:
                del self.collection.rows[index]

    def _write(self, indices: Iterable[int]) -> None:
        path = self._part(self.written)
        rows = [self.collection.rows[index] for index in sorted(indices)]
        write_output(path, KIND, self._content(rows), self.inputs)
        self.written += 1

    def _keep(self) -> None:
        self.pause.begin()
        rows = sorted(self.collection.rows.values(), key=lambda row: row.index)
        self.claim.write(self._content(rows, with_numbers=True))
        self.changed = self.collection.finished
        self.pause.finish()

    def _content(self, rows: list[Row], *, with_numbers: bool = False) -> bytes:
        table = self.collection.make.table(rows)
        columns = {**table.columns, **({WALL: table.wall} if self.timings else {})}
        return parquet({**({ROW: table.rows} if with_numbers else {}), **columns}, {KEY: self.key})

    def table(self) -> Table:
        """Return the table of all rows, which reads a column when it is asked for."""
        make, runs = self.collection.make, self.collection.finished
        columns = PartColumns([self._part(number) for number in range(self.written)])
        wall = columns[WALL] if WALL in columns else np.full(runs, np.nan)
        return PartedTable(
            make.name, make.design, make.quantities, np.arange(runs), columns, wall, make.margins
        )


class PartColumns(Mapping[str, NDArray[Any]]):
    """The columns of several Parquet files, read one at a time."""

    def __init__(self, paths: list[Path]) -> None:
        self.paths = paths
        self.names = pyarrow_library().parquet.read_schema(paths[0]).names

    def __getitem__(self, name: str) -> NDArray[Any]:
        return np.concatenate(list(self.pieces(name)))

    def __iter__(self) -> Iterator[str]:
        return iter(self.names)

    def __len__(self) -> int:
        return len(self.names)

    def pieces(self, name: str) -> Iterator[NDArray[Any]]:
        """Yield a column file by file."""
        if name not in self.names:
            raise KeyError(name)
        for path in self.paths:
            column = pyarrow_library().parquet.read_table(path, columns=[name])[name]
            found = column.to_numpy()
            yield found.astype(np.str_) if found.dtype.kind == "O" else found


class PartedTable(Table):
    """The table of a large sweep, whose columns stand in files."""

    def pieces(self, name: str) -> Iterator[NDArray[Any]]:
        """Yield a column part by part."""
        assert isinstance(self.columns, PartColumns)
        return self.columns.pieces(name)


def sweep_key(jobs: Jobs, diagram_hash: str, columns: Iterable[str]) -> str:
    """Return a text that is equal for sweeps alone whose rows with equal numbers are equal."""
    found = hashlib.sha256()
    for fact in (
        jobs.design.key,
        diagram_hash,
        jobs.seed,
        jobs.base,
        sorted(jobs.files.items()),
        list(columns),
    ):
        found.update(f"{fact!r}\0".encode())
    return found.hexdigest()


def _make_folder(folder: Path) -> None:
    problem = f"cannot write the table '{folder}'"
    with suppress(FileExistsError):
        try:
            folder.mkdir()
        except FileExistsError:
            raise
        except OSError as error:
            raise QuadvisError(f"{problem}: {reason(error)}") from error
    if not folder.is_dir():
        raise QuadvisError(
            f"{problem}: a file is there, and so large a table is a folder; choose another name"
        )
    others = [
        path.name for path in folder.iterdir() if path.name != UNFINISHED and not path.match("part-*.parquet")
    ]
    if others:
        raise QuadvisError(
            f"{problem}: the folder has other files, such as '{others[0]}'; choose another name"
        )
