"""The figures of a run: figures of panels, panels of traces.

A diagram asks for figures under its key `figures`; without that there is one figure per block.
"""

from __future__ import annotations

import math
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
    """One pair of axes; without a unit it has the unit of its first signal. The reference is in that unit."""

    traces: tuple[Trace, ...]
    title: str = ""
    unit: Unit | None = None
    reference: float | None = None


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
