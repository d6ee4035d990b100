"""Recorded signals as files for other programs: CSV, Parquet, MATLAB, NumPy, ULog."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable, Sequence
from io import BytesIO, StringIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from quadvis.errors import QuadvisError, suggestion
from quadvis.machine.files import Kind, write_output
from quadvis.output.log_reader import Log
from quadvis.output.stretch import NANOSECONDS
from quadvis.output.tables import SignalTable, signal_table
from quadvis.output.ulog import ulog

LONGEST_NAME = 63  # of a variable of MATLAB
UNTIDY = "only .csv and .parquet have rows of one time; leave this out, or give one of them"


class TableRequest(NamedTuple):
    """What goes into a file: signals (none: all), those of one rate, rows of one distance, such as 10 ms."""

    signals: tuple[str, ...] = ()
    rate: str = ""
    every: str = ""


def write_table(log: Log, path: Path, wanted: TableRequest) -> None:
    """Write signals of a log into a file whose suffix says its format; QuadvisError if that cannot be."""
    if path.suffix not in FORMATS:
        remedy = suggestion(path.suffix, FORMATS) or f"choose from {', '.join(FORMATS)}"
        raise QuadvisError(f"'{path}' has the suffix '{path.suffix}'; {remedy}")
    kind, made = FORMATS[path.suffix]
    write_output(path, kind, made(log, wanted), [log.path])


def _table(log: Log, wanted: TableRequest) -> SignalTable:
    return signal_table(log, wanted.signals, rate=wanted.rate, every=wanted.every or 0.0)


def _csv(log: Log, wanted: TableRequest) -> bytes:
    """Return lines of numbers under a line of names; units are in brackets after them."""
    table = _table(log, wanted)
    heads = [f"{each.name} ({each.unit})" if each.unit else each.name for each in table.columns]
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["time (s)", *heads])
    columns = [list(map(_text, each.values.tolist())) for each in table.columns]
    writer.writerows(zip(map(_seconds, table.stamps.tolist()), *columns, strict=True))
    return text.getvalue().encode()


def _text(value: Any) -> str:
    """Return a number as text that reads back to the bit; nothing for what is missing."""
    if isinstance(value, bool):
        return str(int(value))
    return "" if value != value else repr(value)


def _seconds(stamp: int) -> str:
    """Return a time without rounding."""
    whole, rest = divmod(stamp, int(NANOSECONDS))
    return f"{whole}.{rest:09d}".rstrip("0").rstrip(".")


def _parquet(log: Log, wanted: TableRequest) -> bytes:
    """Return a table with the time (s) as its first column; fields have their unit as metadata."""
    try:
        import pyarrow
        from pyarrow import parquet
    except ImportError as error:
        raise QuadvisError("Parquet needs the package pyarrow; install 'quadvis[parquet]'") from error
    table = _table(log, wanted)
    columns = [("time", "s", table.times), *table.columns]
    fields = [
        pyarrow.field(name, pyarrow.from_numpy_dtype(values.dtype), metadata={"unit": unit})
        for name, unit, values in columns
    ]
    arrays = [pyarrow.array(values) for _, _, values in columns]
    file = BytesIO()
    parquet.write_table(pyarrow.Table.from_arrays(arrays, schema=pyarrow.schema(fields)), file)
    return file.getvalue()


def _npz(log: Log, wanted: TableRequest) -> bytes:
    """Return each signal as an array of N rows under its name, and its times (s) under NAME.time."""
    file = BytesIO()
    arrays: dict[str, Any] = {}
    for name in _names(log, wanted):
        arrays[name], arrays[f"{name}.time"] = log[name], log.times(name)
    np.savez_compressed(file, **arrays)
    return file.getvalue()


def _mat(log: Log, wanted: TableRequest) -> bytes:
    """Return each signal as a struct with time (s), values and unit, in MATLAB's version 5."""
    from scipy.io import savemat  # python-control brings it

    names = _names(log, wanted)
    made = {
        variable: {"name": name, "time": log.times(name), "values": log[name], "unit": log.port(name).unit}
        for name, variable in zip(names, _variables(names), strict=True)
    }
    file = BytesIO()
    savemat(file, made, long_field_names=True, do_compression=True, oned_as="column")
    return file.getvalue()


def _ulog(log: Log, wanted: TableRequest) -> bytes:
    facts = {"sys_name": "quadvis", "ver_sw": log.metadata.get("version", "")}
    return ulog(log, _names(log, wanted) if wanted.signals else (), facts)


def _names(log: Log, wanted: TableRequest) -> list[str]:
    """Return the signals of a format that keeps each at its own times."""
    if wanted.every or wanted.rate:
        raise QuadvisError(UNTIDY)
    for name in wanted.signals:
        log.find(name)
    return list(wanted.signals) or list(log.names)


def _variables(names: Sequence[str]) -> list[str]:
    """Return names that MATLAB permits, each once."""
    found: list[str] = []
    for name in names:
        plain = re.sub(r"\W", "_", name, flags=re.ASCII)
        plain = (plain if plain[:1].isalpha() else f"x{plain}")[:LONGEST_NAME]
        count = 1
        unique = plain
        while unique in found:
            count += 1
            ending = f"_{count}"
            unique = plain[: LONGEST_NAME - len(ending)] + ending
        found.append(unique)
    return found


FORMATS: dict[str, tuple[Kind, Callable[[Log, TableRequest], bytes]]] = {
    ".csv": (Kind("the table", (b"time",)), _csv),
    ".parquet": (Kind("the table", (b"PAR1",)), _parquet),
    ".mat": (Kind("the MATLAB file", (b"MATLAB",)), _mat),
    ".npz": (Kind("the arrays", (b"PK",)), _npz),
    ".ulg": (Kind("the ULog", (b"ULog",)), _ulog),
}
