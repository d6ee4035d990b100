"""The table of a sweep: columns in memory, and files for other tools, written whole or not at all."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, counted
from quadvis.machine.files import Kind, write_output
from quadvis.sweeps.axes import GRID, SEED
from quadvis.sweeps.designs import Design
from quadvis.sweeps.worker import Quantity

PASSED, FAILURE, HASH, WALL = "passed", "failure", "hash", "wall [s]"
KINDS = {
    ".csv": Kind("the table", pattern=rb"(^|,)passed,failure,hash[,\r\n]"),
    ".parquet": Kind("the table", (b"PAR1",)),
}


class Table(Mapping[str, NDArray[Any]]):
    """The runs of a sweep, one a row: ``table["xy.rms [cm]"]`` is a column of N values.

    The columns are the axes, the quantities (NaN for a run without results), ``passed``, ``failure`` (why a
    run stopped, or "") and ``hash`` (of the resolved diagram, seed included). ``wall`` (s) is the wall time
    of each run. It is not a column, because it alone differs between two sweeps of the same runs. ``margins``
    is the number of the diagram's expectations on its loop, which no run judges. ``note`` is a sentence about
    a sweep that was to end early.
    """

    def __init__(
        self,
        name: str,
        design: Design,
        quantities: Sequence[Quantity],
        rows: NDArray[np.int64],
        columns: Mapping[str, NDArray[Any]],
        wall: NDArray[np.float64],
        margins: int = 0,
    ) -> None:
        """Keep the columns; ``rows`` (N,) are the runs' numbers in the design."""
        self.name, self.design, self.quantities = name, design, tuple(quantities)
        self.rows, self.columns, self.wall, self.margins = rows, columns, wall, margins
        self.note = ""

    def __repr__(self) -> str:
        return f"<Table of {self.name}: {counted(self.runs, 'run')}, {counted(len(self), 'column')}>"

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    @property
    def runs(self) -> int:
        """The number of rows."""
        return len(self.rows)

    @property
    def passed(self) -> bool:
        """True if every run met all its expectations."""
        return bool(self.columns[PASSED].all())

    def groups(self) -> list[tuple[tuple[int, ...], NDArray[np.intp]]]:
        """Return the points of a grid without the seed, as indices of values, each with its rows.

        Another design is one group.
        """
        others = [number for number, axis in enumerate(self.design.axes) if axis.name != SEED]
        if self.design.name != GRID or not others:
            return [((), np.arange(self.runs))] if self.runs else []
        points, inverse = np.unique(self.design.places(self.rows)[:, others], axis=0, return_inverse=True)
        order = np.argsort(inverse.reshape(-1), kind="stable")
        ends = np.cumsum(np.bincount(inverse.reshape(-1), minlength=len(points)))[:-1]
        groups = np.split(order, ends) if len(points) else []
        return [(tuple(map(int, point)), rows) for point, rows in zip(points, groups, strict=True)]

    def reasons(self) -> dict[str, tuple[int, int]]:
        """Return why runs stopped: for each reason the first such row here, and how many there are."""
        found: dict[str, tuple[int, int]] = {}
        row = 0
        for piece in self.pieces(FAILURE):
            for here in np.flatnonzero(piece != "").tolist():
                first, count = found.get(str(piece[here]), (row + here, 0))
                found[str(piece[here])] = first, count + 1
            row += len(piece)
        return found

    def pieces(self, name: str) -> Iterator[NDArray[Any]]:
        """Yield a column piece by piece."""
        yield self[name]

    def save(self, path: str | Path, *, timings: bool = False, inputs: Iterable[Path] = ()) -> None:
        """Write a CSV or Parquet file, by the name's ending; ``timings`` adds the column ``wall [s]``.

        An older file stays until the new one is complete. QuadvisError if the file cannot be written, if it
        is one of ``inputs``, or if an older file there is no table.
        """
        path = Path(path)
        write_output(path, table_kind(path), self.content(path.suffix, timings=timings), inputs)

    def content(self, suffix: str, *, timings: bool = False, head: bool = True) -> bytes:
        """Return the contents of a file with this suffix; CSV without its first line if ``head`` is false."""
        columns = {**self.columns, **({WALL: self.wall} if timings else {})}
        return _csv(columns, head) if suffix == ".csv" else parquet(columns)


def table_kind(path: Path) -> Kind:
    """Return the kind of a table's file; QuadvisError if its suffix is not that of a table."""
    if path.suffix not in KINDS:
        raise QuadvisError(f"cannot write the table '{path}': its name must end in .csv or .parquet")
    if path.suffix == ".parquet":
        pyarrow_library()
    return KINDS[path.suffix]


def pyarrow_library() -> Any:
    """Return the package pyarrow; QuadvisError if it is not installed."""
    try:
        import pyarrow.parquet
    except ImportError:
        remedy = "pip install 'quadvis[parquet]', or end its name in .csv"
        raise QuadvisError(f"a Parquet table needs the package pyarrow; {remedy}") from None
    return pyarrow


def _csv(columns: Mapping[str, NDArray[Any]], head: bool) -> bytes:
    """Return the rows as CSV; numbers read back to the same bits."""
    file = StringIO(newline="")
    writer = csv.writer(file, lineterminator="\n")
    if head:
        writer.writerow(columns)
    cells = [[_cell(value) for value in column.tolist()] for column in columns.values()]
    writer.writerows(zip(*cells, strict=True))
    return file.getvalue().encode()


def _cell(value: Any) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return "" if math.isnan(value) else repr(value)
    return str(value)


def parquet(columns: Mapping[str, NDArray[Any]], facts: Mapping[str, str] | None = None) -> bytes:
    """Return the columns as a Parquet file, with facts in its metadata."""
    pyarrow, file = pyarrow_library(), BytesIO()
    arrays = {name: pyarrow.array(column.tolist(), _arrow_type(column)) for name, column in columns.items()}
    table = pyarrow.table(arrays)
    pyarrow.parquet.write_table(table.replace_schema_metadata(facts) if facts else table, file)
    return file.getvalue()


def _arrow_type(column: NDArray[Any]) -> Any:
    pyarrow = pyarrow_library()
    kinds = {"f": pyarrow.float64, "i": pyarrow.int64, "b": pyarrow.bool_}
    return kinds.get(column.dtype.kind, pyarrow.string)()


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Return the rows of an existing table; QuadvisError if the file is no table.

    All cells of a CSV file are texts.
    """
    try:
        if path.suffix == ".parquet":
            rows: list[dict[str, Any]] = pyarrow_library().parquet.read_table(path).to_pylist()
            return rows
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file, strict=True))
    except (OSError, ValueError, csv.Error) as error:
        raise QuadvisError(f"cannot read the table '{path}': {str(error).splitlines()[0]}") from error
