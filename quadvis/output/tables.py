"""Recorded signals of several rates as one table: a row for each time, a column for each element."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted, suggestion
from quadvis.graph.graph import CONTINUOUS
from quadvis.graph.names import index_text
from quadvis.output.recording import RecordedPort, Recording
from quadvis.output.stretch import NANOSECONDS
from quadvis.units import Unit, parse_rational

Stamps = NDArray[np.int64]
SECOND = Unit.parse("s")
MOST_ROWS = 1 << 26  # of a table whose rows are asked for by their distance


class Column(NamedTuple):
    """One element of a signal at the times of a table: float64, or int64 or bool where nothing is missing."""

    name: str
    unit: str
    values: NDArray[Any]


class SignalTable(NamedTuple):
    """The columns of some signals at common times; ``stamps`` are these times (ns)."""

    stamps: Stamps
    columns: tuple[Column, ...]

    @property
    def times(self) -> NDArray[np.float64]:
        """The times (s)."""
        return self.stamps / NANOSECONDS


def signal_table(
    recording: Recording, signals: Sequence[str] = (), *, rate: str = "", every: str | float = 0.0
) -> SignalTable:
    """Return a table of signals, of all of them if none is named.

    Its rows are at all times at which one of the signals has a sample; with ``rate`` it has the signals of
    this rate alone; with ``every``, such as "10 ms" or a number of seconds, its rows have this distance, from
    the first sample to the last. A sampled signal holds its value until its next sample, a continuous one
    moves in straight lines between samples; before its first sample a signal is missing, which is NaN.

    QuadvisError if there is no such signal or rate, or if the rows would be too many.
    """
    names = _chosen(recording, signals, rate)
    each = [recording.stamps(name) for name in names]
    stamps = np.unique(np.concatenate(each)) if each else np.zeros(0, np.int64)
    if every:
        stamps = _even(stamps, _distance(every))
    columns = (column for name in names for column in _columns(recording, name, stamps))
    return SignalTable(stamps, tuple(columns))


def _chosen(recording: Recording, signals: Sequence[str], rate: str) -> list[str]:
    """Return the names of the signals that are asked for."""
    names = list(signals) or list(recording.names)
    for name in names:
        recording.find(name)
    if not rate:
        return names
    rates = {name: recording.rate(name) for name in names}
    if rate not in rates.values():
        remedy = suggestion(rate, filter(None, dict.fromkeys(rates.values())))
        raise QuadvisError(f"no signal has the rate {quoted(rate)}; {remedy}".removesuffix("; "))
    return [name for name in names if rates[name] == rate]


def _distance(every: str | float) -> int:
    """Return the distance of rows (ns)."""
    text = every if isinstance(every, str) else f"{float(every)!r} s"
    found = round(parse_rational(text, SECOND) * NANOSECONDS)
    if found < 1:
        raise QuadvisError(f"the distance of rows is {quoted(text)}; it must be above 0 s")
    return found


def _even(stamps: Stamps, every: int) -> Stamps:
    """Return times of one distance (ns) over those of the samples."""
    if not stamps.size:
        return stamps
    count = int(stamps[-1] - stamps[0]) // every + 1
    if count > MOST_ROWS:
        raise QuadvisError(f"a table of {count} rows is too long; let their distance be longer")
    even: Stamps = np.arange(count, dtype=np.int64) * every + stamps[0]
    return even


def _columns(recording: Recording, name: str, stamps: Stamps) -> Iterator[Column]:
    """Yield the columns of a signal."""
    port, rows, own = recording.port(name), recording[name], recording.stamps(name)
    straight = recording.rate(name) == CONTINUOUS and port.type == "float64"
    values = rows.reshape(len(rows), port.size)
    for number, (element, unit) in enumerate(zip(elements(recording, name), units(port), strict=True)):
        yield Column(element, unit, _at(values[:, number], own, stamps, straight))


def _at(values: NDArray[Any], own: Stamps, stamps: Stamps, straight: bool) -> NDArray[Any]:
    """Return values at other times."""
    if not own.size:
        return np.full(len(stamps), np.nan)
    places = np.searchsorted(own, stamps, side="right") - 1
    early = places < 0
    held = values[np.maximum(places, 0)]
    if straight:
        between = np.interp(stamps - own[0], own - own[0], values)
        held = np.where(own[np.maximum(places, 0)] == stamps, held, between)  # a sample is itself to the bit
    return np.where(early, np.nan, held) if early.any() else held


def elements(recording: Recording, name: str) -> list[str]:
    """Return the names of a signal's elements, in the order of its values."""
    whole, index = name.partition("[")[0], recording.wire(name).index if "[" in name else ()
    shape = recording.port(whole).shape
    if not shape:
        return [name]
    names = np.array([f"{whole}{index_text(each)}" for each in np.ndindex(shape)]).reshape(shape)
    return list(np.ravel(names[index]))


def units(port: RecordedPort) -> list[str]:
    """Return the units of a signal's elements; "" without one."""
    each = port.unit.split(" ")
    found = each if len(each) > 1 else each * port.size
    return ["" if unit == "1" else unit for unit in _repeated(found, port.size)]


def _repeated(found: Sequence[str], size: int) -> Iterable[str]:
    """Return one unit for each element; those of a row hold for all rows of a matrix."""
    return (found[number % len(found)] for number in range(size))
