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

from quadvis.errors import QuadvisError
from quadvis.machine.files import Kind, write_output
from quadvis.sweeps.axes import SEED, Axis
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
    is the number of the diagram's expectations on its loop, which no run judges.
    """

    def __init__(
        self,
        name: str,
        axes: Sequence[Axis],
        quantities: Sequence[Quantity],
        indices: NDArray[np.int64],
        columns: Mapping[str, NDArray[Any]],
        wall: NDArray[np.float64],
        margins: int = 0,
    ) -> None:
        """Keep the columns; ``indices`` (N, axes) are each run's indices of values on the axes."""
        self.name, self.axes, self.quantities = name, tuple(axes), tuple(quantities)
        self.indices, self.columns, self.wall, self.margins = indices, dict(columns), wall, margins

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.columns[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.columns)

    def __len__(self) -> int:
        return len(self.columns)

    @property
    def runs(self) -> int:
        """The number of rows."""
        return len(self.indices)

    @property
    def passed(self) -> bool:
        """True if every run met all its expectations."""
        return bool(self.columns[PASSED].all())

    def groups(self) -> list[tuple[tuple[int, ...], NDArray[np.intp]]]:
        """Return the points of the grid without the seed, as indices of values, each with its rows."""
        others = [number for number, axis in enumerate(self.axes) if axis.name != SEED]
        found: dict[tuple[int, ...], list[int]] = {}
        for row, point in enumerate(self.indices[:, others].tolist()):
            found.setdefault(tuple(point), []).append(row)
        return [(point, np.array(found[point])) for point in sorted(found)]

    def save(self, path: str | Path, *, timings: bool = False, inputs: Iterable[Path] = ()) -> None:
        """Write a CSV or Parquet file, by the name's ending; ``timings`` adds the column ``wall [s]``.

        An older file stays until the new one is complete. QuadvisError if the file cannot be written, if it
        is one of ``inputs``, or if an older file there is no table.
        """
        path = Path(path)
        write_output(path, table_kind(path), self.content(path.suffix, timings=timings), inputs)

    def content(self, suffix: str, *, timings: bool = False, head: bool = True) -> bytes:
        """Return the contents of a file with this suffix; CSV without its first line if ``head`` is false."""
        columns = self.columns | ({WALL: self.wall} if timings else {})
        return _csv(columns, head) if suffix == ".csv" else _parquet(columns)


def table_kind(path: Path) -> Kind:
    """Return the kind of a table's file; QuadvisError if its suffix is not that of a table."""
    if path.suffix not in KINDS:
        raise QuadvisError(f"cannot write the table '{path}': its name must end in .csv or .parquet")
    if path.suffix == ".parquet":
        _pyarrow()
    return KINDS[path.suffix]


def _pyarrow() -> Any:
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


def _parquet(columns: Mapping[str, NDArray[Any]]) -> bytes:
    pyarrow, file = _pyarrow(), BytesIO()
    arrays = {name: pyarrow.array(column.tolist(), _arrow_type(column)) for name, column in columns.items()}
    pyarrow.parquet.write_table(pyarrow.table(arrays), file)
    return file.getvalue()


def _arrow_type(column: NDArray[Any]) -> Any:
    pyarrow = _pyarrow()
    kinds = {"f": pyarrow.float64, "i": pyarrow.int64, "b": pyarrow.bool_}
    return kinds.get(column.dtype.kind, pyarrow.string)()


def read_rows(path: Path) -> list[dict[str, Any]]:
    """Return the rows of an existing table; QuadvisError if the file is no table.

    All cells of a CSV file are texts.
    """
    try:
        if path.suffix == ".parquet":
            rows: list[dict[str, Any]] = _pyarrow().parquet.read_table(path).to_pylist()
            return rows
        with path.open(encoding="utf-8", newline="") as file:
            return list(csv.DictReader(file, strict=True))
    except (OSError, ValueError, csv.Error) as error:
        raise QuadvisError(f"cannot read the table '{path}': {str(error).splitlines()[0]}") from error
