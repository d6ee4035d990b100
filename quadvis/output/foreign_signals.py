"""Signals from files of other programs: CSV, Parquet, NumPy's .npz, MATLAB's .mat; `ros_signals` reads MCAP.

A table has the time in one column, "time", "t" or "timestamp", with its unit if that is not s, "time (ms)",
and a signal in each other one; the unit of a signal stands after its name, "speed (m/s)" or "speed [m/s]".
Columns "pose[0]", "pose[1]" that lie side by side are one signal. An empty cell is no sample.

In .npz and .mat each signal is an array of N rows. Its times are an array "NAME.time" (NAME_time in MATLAB),
or else the array "time", "t", "tout" or "timestamp". MATLAB's structures with time are read, too: those of
Simulink and of ``quadvis export`` (`mat_files`).
"""

from __future__ import annotations

import csv
import re
import zipfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.document.mat_files import read_mat
from quadvis.errors import QuadvisError, quoted
from quadvis.machine.inputs import read_input
from quadvis.output.foreign_recording import KINDS, ForeignSignals
from quadvis.output.log_reader import Log, is_foreign, read_log
from quadvis.output.ros_signals import read_messages
from quadvis.output.stretch import NANOSECONDS
from quadvis.units import Unit, UnitError

TIMES = ("time", "t", "timestamp", "tout", "stamp")
SECOND = Unit.parse("s")
MOST_BYTES = 1 << 31
MOST_SIZE = 1 << 31  # bytes of all arrays in an archive
_HEAD = re.compile(r"(?P<name>.*?)\s*(?:\((?P<round>[^()]*)\)|\[(?P<square>[^\[\]]*)\])?\s*")
_ELEMENT = re.compile(r"(?P<name>.*)\[(?P<number>[0-9]+)\]")


class _Head(NamedTuple):
    """What the head of a column says."""

    name: str
    unit: str


Played = Log | ForeignSignals


def read_recording(path: str | Path) -> Played:
    """Read the log of a run, or a file of another program, which is known by its suffix."""
    if Path(path).suffix.lower() in READERS:
        return read_signals(path)
    return read_messages(path) if is_foreign(path) else read_log(path)


def read_signals(path: str | Path) -> ForeignSignals:
    """Read the signals of a file; its suffix says the format. QuadvisError says what is wrong in it."""
    file = Path(path)
    data = read_input(file, MOST_BYTES, "the recording")
    signals = ForeignSignals(file)
    try:
        READERS[file.suffix.lower()](data, signals)
        for name, why in {} if signals.names else signals.unplayed.items():
            raise QuadvisError(f"there is no signal in it; {quoted(name)} is none: {why}")
    except QuadvisError as error:
        raise QuadvisError(f"'{path}': {error}") from error
    return signals


def _csv(data: bytes, signals: ForeignSignals) -> None:
    text = data.decode("utf-8-sig", errors="replace")
    sample = text.partition("\n")[0]
    separator = max(",;\t", key=sample.count)
    rows = csv.reader(text.splitlines(), delimiter=separator)
    heads = next(rows, None)
    if heads is None or not any(map(str.strip, heads)):
        raise QuadvisError("the file is empty; give it a line of names, and a line for each time")
    cells: list[list[str]] = [[] for _ in heads]
    for line, row in enumerate(rows, 2):
        if not row:
            continue
        if len(row) != len(heads):
            raise QuadvisError(f"line {line} has {len(row)} cells, the first line {len(heads)}")
        for column, cell in zip(cells, row, strict=True):
            column.append(cell.strip())
    _take_columns(
        signals, [(head, *_numbers(head, column)) for head, column in zip(heads, cells, strict=True)]
    )


def _numbers(head: str, cells: list[str]) -> tuple[NDArray[Any], NDArray[np.bool_]]:
    """Return the numbers of a column, and which cells have one."""
    there = np.array([bool(cell) for cell in cells], bool)
    words = {"true": "1", "false": "0"}
    texts = [words.get(cell.lower(), cell) if cell else "nan" for cell in cells]
    try:
        return np.array(texts, np.float64), there
    except ValueError:
        line = next(line for line, text in enumerate(texts, 2) if not _is_number(text))
        raise QuadvisError(
            f"line {line}: {quoted(cells[line - 2])} in column {quoted(head)} is no number"
        ) from None


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _parquet(data: bytes, signals: ForeignSignals) -> None:
    try:
        from pyarrow import ArrowException, parquet
    except ImportError as error:
        raise QuadvisError("Parquet needs the package pyarrow; install 'quadvis[parquet]'") from error
    try:
        table = parquet.read_table(BytesIO(data))
    except (ArrowException, OSError) as error:
        raise QuadvisError(f"this is no Parquet file that can be read: {error}") from error
    columns = []
    for field, column in zip(table.schema, table.columns, strict=True):
        unit = (field.metadata or {}).get(b"unit", b"").decode(errors="replace")
        head = f"{field.name} ({unit})" if unit else field.name
        there = ~np.asarray(column.is_null())
        values = np.asarray(column.fill_null(0) if column.null_count else column)
        if values.dtype.kind not in KINDS:
            raise QuadvisError(f"column {quoted(field.name)} has no numbers but {field.type}")
        columns.append((head, values, there))
    _take_columns(signals, columns)


def _take_columns(
    signals: ForeignSignals, columns: Iterable[tuple[str, NDArray[Any], NDArray[np.bool_]]]
) -> None:
    """Take the columns of a table: heads, numbers, and which of them are there."""
    named = [(_head(text), values, there) for text, values, there in columns]
    found = [each for each in named if each[0].name.lower() in TIMES]
    if not found:
        raise QuadvisError("no column has the time; call one 'time (s)'")
    time, times, known = found[0]
    if not known.all():
        raise QuadvisError(f"column {quoted(time.name)} has empty cells; each row needs its time")
    stamps = _stamps(time.name, times, time.unit)
    rest = [each for each in named if each[0].name != time.name]
    for name, unit, members in _joined(rest):
        there = np.logical_and.reduce([each for _, each in members])
        values = [numbers[there] for numbers, _ in members]
        signals.take(name, unit, stamps[there], np.stack(values, axis=1) if len(values) > 1 else values[0])


def _joined(
    columns: list[tuple[_Head, NDArray[Any], NDArray[np.bool_]]],
) -> Iterator[tuple[str, str, list[tuple[NDArray[Any], NDArray[np.bool_]]]]]:
    """Yield signals: columns "pose[0]", "pose[1]" side by side are one; each has its name and its units."""
    place = 0
    while place < len(columns):
        match = _ELEMENT.fullmatch(columns[place][0].name)
        count = 1
        if match is not None and match["number"] == "0":
            while (
                place + count < len(columns) and columns[place + count][0].name == f"{match['name']}[{count}]"
            ):
                count += 1
        group = columns[place : place + count]
        units = [head.unit or "1" for head, _, _ in group]
        unit = units[0] if len(set(units)) == 1 else " ".join(units)
        name = match["name"] if match is not None and count > 1 else columns[place][0].name
        yield name, unit, [(values, there) for _, values, there in group]
        place += count


def _head(text: str) -> _Head:
    """Return the name and the unit of a column; what is in brackets and is no unit belongs to the name."""
    match = _HEAD.fullmatch(text.strip())
    unit = (match["round"] or match["square"] or "") if match is not None else ""
    if match is None or not unit or unit.isdigit():
        return _Head(text.strip(), "")
    try:
        Unit.parse(unit)
    except UnitError:
        return _Head(text.strip(), "")
    return _Head(match["name"], unit)


def _stamps(name: str, times: NDArray[Any], unit: str = "") -> NDArray[np.int64]:
    """Return times in a unit as whole nanoseconds, rounded."""
    scale = Unit.parse(unit) if unit else SECOND
    if not scale.dimension_equals(SECOND):
        raise QuadvisError(f"{quoted(name)} is in {unit}, which is no time")
    if not np.isfinite(times).all():
        raise QuadvisError(f"{quoted(name)} has times that are no numbers")
    return np.round(times * (scale.scale * NANOSECONDS)).astype(np.int64)


def _npz(data: bytes, signals: ForeignSignals) -> None:
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            size = sum(each.file_size for each in archive.infolist())
        if size > MOST_SIZE:
            raise QuadvisError(f"its arrays have {size / 1e6:g} MB, more than {MOST_SIZE / 1e6:g} MB")
        with np.load(BytesIO(data), allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (OSError, ValueError, EOFError, zipfile.BadZipFile, NotImplementedError) as error:
        raise QuadvisError(f"this is no file of numpy.savez that can be read: {error}") from error
    _take_arrays(signals, arrays, ".time")


def _mat(data: bytes, signals: ForeignSignals) -> None:
    arrays = read_mat(data)
    structures = {name: arrays.pop(name) for name in list(arrays) if isinstance(arrays[name], dict)}
    for name, structure in structures.items():
        _take_structure(signals, name, structure)
    plain = {name: np.asarray(value) for name, value in arrays.items()}
    if plain or not structures:
        _take_arrays(signals, plain, "_time")


def _take_structure(signals: ForeignSignals, name: str, structure: Mapping[str, Any]) -> None:
    """Take a structure with time: that of ``quadvis export``, or that of Simulink, with its signals."""
    if "time" not in structure:
        return
    stamps = _stamps(name, np.atleast_1d(np.asarray(structure["time"], np.float64)).ravel())
    if "values" in structure:
        unit = str(structure.get("unit", "") or "")
        _take_rows(signals, str(structure.get("name", name)), unit, stamps, np.asarray(structure["values"]))
        return
    inner = structure.get("signals", [])
    for number, each in enumerate(inner if isinstance(inner, (list, np.ndarray)) else [inner]):
        if isinstance(each, dict) and "values" in each:
            label = each.get("label", "")
            label = label if isinstance(label, str) and label else str(number)
            full = name if not isinstance(inner, (list, np.ndarray)) else f"{name}.{label}"
            _take_rows(signals, full, "", stamps, np.asarray(each["values"]))


def _take_arrays(signals: ForeignSignals, arrays: Mapping[str, NDArray[Any]], ending: str) -> None:
    """Take arrays of N rows, with times of their own or with those of all."""
    common = next((name for each in TIMES for name in arrays if name.lower() == each), None)
    own = {name for name in arrays if name.endswith(ending) and name.removesuffix(ending) in arrays}
    for name, values in arrays.items():
        if name == common or name in own:
            continue
        time = f"{name}{ending}" if f"{name}{ending}" in own else common
        if time is None:
            signals.unplayed[name] = f"it has no times; add an array '{name}{ending}', or 'time' for all"
            continue
        stamps = _stamps(time, np.asarray(arrays[time], np.float64).ravel())
        _take_rows(signals, name, "", stamps, values)


def _take_rows(
    signals: ForeignSignals, name: str, unit: str, stamps: NDArray[np.int64], values: NDArray[Any]
) -> None:
    """Take an array of N rows; one of (N, 1) is that of a scalar, as MATLAB has them."""
    if values.dtype.kind not in KINDS:
        signals.unplayed[name] = "it has no numbers"
        return
    values = np.atleast_1d(values)
    if values.ndim == 2 and values.shape[1] == 1:
        values = values[:, 0]
    if len(values) != len(stamps):
        signals.unplayed[name] = f"it has {len(values)} rows, and {len(stamps)} times"
        return
    signals.take(name, unit, stamps, values)


READERS: dict[str, Callable[[bytes, ForeignSignals], None]] = {
    ".csv": _csv,
    ".parquet": _parquet,
    ".npz": _npz,
    ".mat": _mat,
}
