"""Recorded signals as objects of pandas and xarray; both are imported when they are asked for."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from types import ModuleType
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.graph.names import index_text
from quadvis.output.recording import Recording
from quadvis.output.stretch import NANOSECONDS
from quadvis.output.tables import SignalTable


def as_frame(table: SignalTable) -> Any:
    """Return a table as a pandas.DataFrame: its index is the time (s), ``attrs["units"]`` has the units."""
    pandas = _package("pandas")
    columns = {column.name: column.values for column in table.columns}
    frame = pandas.DataFrame(columns, index=pandas.Index(table.times, name="time"))
    frame.attrs["units"] = {column.name: column.unit for column in table.columns}
    return frame


def as_dataset(recording: Recording, signals: Sequence[str] = ()) -> Any:
    """Return signals as an xarray.Dataset, each at its own times (s).

    Signals with equal times have one coordinate: "time" of the rate that has most samples, "time_RATE" or
    "time_N" of others. ``attrs["units"]`` of a variable is its unit.
    """
    xarray = _package("xarray")
    axes: dict[bytes, str] = {}
    variables, coordinates = {}, {}
    names = list(signals) or list(recording.names)
    for name in sorted(names, key=lambda each: -len(recording.stamps(each))):
        stamps, port = recording.stamps(name), recording.port(name)
        key = stamps.tobytes()
        if key not in axes:
            axes[key] = _axis(recording.rate(name), set(axes.values()))
            coordinates[axes[key]] = (axes[key], stamps / NANOSECONDS, {"units": "s"})
        sizes = [f"{name}{index_text((axis,))}" for axis in range(len(port.shape))]
        variables[name] = ((axes[key], *sizes), recording[name], {"units": port.unit})
    return xarray.Dataset({name: variables[name] for name in names}, coordinates)


def _axis(rate: str, taken: set[str]) -> str:
    """Return a name for a new axis of time."""
    if not taken:
        return "time"
    name = f"time_{rate}" if rate else f"time_{len(taken)}"
    return name if name not in taken else f"{name}_{len(taken)}"


def _package(name: str) -> ModuleType:
    """Import a package that quadvis does not require."""
    try:
        return import_module(name)
    except ImportError as error:
        raise QuadvisError(f"this needs the package {name}; install 'quadvis[frames]'") from error
