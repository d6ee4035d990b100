"""The curves of a panel from the recorded signals: one for each element, in the unit of the panel."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError, quoted, suggestion
from quadvis.graph.graph import CONTINUOUS
from quadvis.graph.names import index_text, wire_text
from quadvis.output.figures import Figure, Panel, Trace
from quadvis.output.recording import Recorded
from quadvis.units import Unit, parse_units

NO_UNIT = Unit()


@dataclass(frozen=True)
class Curve:
    """The samples of one number in a stretch of the run, in the unit of the panel.

    A ``held`` curve stands still between samples, the samples of other curves are joined by lines. ``before``
    is the value held when the stretch begins. ``whole`` numbers are counts, levels and truth values. A curve
    that does not stand over the time has the values that are across, ``across``, in the unit ``across_unit``.
    ``recording`` is the number of the recording that it comes from, ``place`` its own number there.
    """

    label: str
    unit: Unit
    times: NDArray[np.float64]
    values: NDArray[np.float64]
    held: bool
    whole: bool
    before: float = math.nan
    across: NDArray[np.float64] | None = None
    across_unit: Unit = NO_UNIT
    across_label: str = ""
    recording: int = 0
    place: int = 0


def values_at(curve: Curve, times: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the values of a curve at other times; NaN before its first sample."""
    if not curve.times.size:
        return np.full(len(times), np.nan)
    if curve.held:
        places = np.searchsorted(curve.times, times, side="right") - 1
        return np.where(places < 0, curve.before, curve.values[places])
    inside = np.interp(times, curve.times, curve.values)
    return np.where((times < curve.times[0]) | (times > curve.times[-1]), np.nan, inside)


def panel_curves(recorded: Recorded, figure: Figure, panel: Panel) -> list[Curve]:
    """Return a panel's curves over the figure's stretch of the run, in the unit of the panel."""
    found = [curve for trace in panel.traces for curve in _elements(recorded, trace)]
    if not found:
        raise QuadvisError(f"panel {quoted(panel.title)} has no signals; name one")
    shown = panel.unit or found[0].unit
    over = None if panel.against is None else _one(recorded, panel.against, shown)
    curves = []
    for place, curve in enumerate(found):
        if not curve.unit.dimension_equals(shown):
            raise QuadvisError(f"{quoted(curve.label)} is in {curve.unit}, which cannot be shown in {shown}")
        part = (curve.times >= figure.start) & (curve.times <= figure.stop)
        values = curve.values * (curve.unit.scale / shown.scale)
        earlier = values[curve.times < figure.start]
        before = float(earlier[-1]) if earlier.size else math.nan
        times = curve.times[part]
        made = replace(curve, unit=shown, times=times, values=values[part], before=before, place=place)
        if over is not None:
            across = values_at(over, times)
            made = replace(made, across=across, across_unit=over.unit, across_label=over.label)
        curves.append(made)
    return curves


def _one(recorded: Recorded, trace: Trace, shown: Unit) -> Curve:
    """Return the one element that lies across, in the unit of the panel if that can be."""
    elements = list(_elements(recorded, trace))
    if len(elements) != 1:
        name = wire_text(trace.signal)
        raise QuadvisError(f"{quoted(name)} has {len(elements)} elements; name one of them to lie across")
    curve = elements[0]
    if not curve.unit.dimension_equals(shown):
        return curve
    return replace(curve, unit=shown, values=curve.values * (curve.unit.scale / shown.scale))


def _elements(recorded: Recorded, trace: Trace) -> Iterator[Curve]:
    """Return one curve for every element that a trace selects."""
    name, index = trace.signal.source, trace.signal.index
    if name not in recorded.units:
        remedy = suggestion(name, recorded.units) or "the log may leave its block out"
        raise QuadvisError(f"there is no signal {quoted(name)}; {remedy}")
    rows, times, units = recorded[name], recorded.times(name), parse_units(recorded.units[name])
    shape, size = rows.shape[1:], math.prod(rows.shape[1:])
    try:
        chosen = np.arange(size).reshape(shape)[index].ravel().tolist()
    except IndexError:
        chosen = []
    if not chosen:
        extent = f"the shape {list(shape)}" if shape else "one element and takes no index"
        raise QuadvisError(f"{quoted(wire_text(trace.signal))} does not exist; {quoted(name)} has {extent}")
    elements = rows.reshape(len(rows), size)
    held = rows.dtype.kind != "f" or recorded.rate(name) not in ("", CONTINUOUS)
    for element in chosen:
        label = trace.label or name
        if shape and (len(chosen) > 1 or not trace.label):
            label += index_text(np.unravel_index(element, shape))
        values = elements[:, element].astype(np.float64)
        yield Curve(label, units[element % len(units)], times, values, held, rows.dtype.kind != "f")
