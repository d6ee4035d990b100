"""The figures of a run: figures of panels, panels of traces.

A diagram asks for figures under its key `figures`; without that there is one figure per block.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from quadvis.graph.graph import Wire
from quadvis.graph.names import wire_text
from quadvis.output.recording import Recorded
from quadvis.units import Unit, parse_units


class Trace(NamedTuple):
    """A signal or some of its elements, with its label in the legend."""

    signal: Wire
    label: str = ""


class Panel(NamedTuple):
    """One pair of axes; without a unit it has the unit of its first signal. The reference is in that unit.

    The signals stand over the time, or over one element of the signal ``against``.
    """

    traces: tuple[Trace, ...]
    title: str = ""
    unit: Unit | None = None
    reference: float | None = None
    against: Trace | None = None


class Figure(NamedTuple):
    """One picture, of the run between `start` and `stop` (s)."""

    title: str
    panels: tuple[Panel, ...]
    start: float = -math.inf
    stop: float = math.inf


def block_figures(recorded: Recorded) -> list[Figure]:
    """Return a figure for every block, with a panel for every port, or for every unit of a port."""
    blocks: dict[str, list[Panel]] = {}
    for name, text in recorded.units.items():
        block, _, port = name.rpartition(".")
        panels = blocks.setdefault(block, [])
        units = parse_units(text)
        if len(units) == 1:
            panels.append(Panel((Trace(Wire(block, port), port),), port))
            continue
        indices = list(np.ndindex(recorded[name].shape[1:]))
        for shown in dict.fromkeys(units):
            wires = [
                Wire(block, port, index) for index, unit in zip(indices, units, strict=True) if unit == shown
            ]
            traces = tuple(Trace(wire, wire_text(wire).removeprefix(f"{block}.")) for wire in wires)
            panels.append(Panel(traces, port))
    return [Figure(block, tuple(panels)) for block, panels in blocks.items()]


def signal_figure(traces: Sequence[Trace], units: Mapping[str, str], against: Trace | None = None) -> Figure:
    """Return one figure of these signals: a panel for each dimension, or for each signal over another."""
    alike: list[tuple[Unit, list[Trace]]] = []
    for trace in traces:
        unit = parse_units(units[trace.signal.source])[0]
        same = next((found for shown, found in alike if shown.dimension_equals(unit)), None)
        if same is None or against is not None:
            alike.append((unit, same := []))
        same.append(trace)
    title = ", ".join(trace.label for trace in traces)
    title += f" against {against.label}" if against is not None else ""
    return Figure(title, tuple(Panel(tuple(found), against=against) for _, found in alike))


def with_signals(panel: Panel, wire: Callable[[Wire], Wire]) -> Panel:
    """Return a panel that has in the place of each signal what ``wire`` returns for it."""

    def changed(trace: Trace) -> Trace:
        return Trace(wire(trace.signal), trace.label or wire_text(trace.signal))

    against = None if panel.against is None else changed(panel.against)
    return panel._replace(traces=tuple(map(changed, panel.traces)), against=against)
