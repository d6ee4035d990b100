"""Several recordings in one picture: each curve once for each, and of two recordings their difference."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.graph.graph import Wire
from quadvis.graph.names import index_text
from quadvis.output.curves import Curve, panel_curves, values_at
from quadvis.output.figures import Figure, Panel, with_signals
from quadvis.output.recording import Recorded, Recording

Drawn = tuple[Panel, list[Curve]]


class RunOverlay:
    """Recordings by name, at least one; figures of them have the curves of all."""

    def __init__(self, recordings: Sequence[tuple[str, Recorded]]) -> None:
        self._recordings = recordings

    def drawn(self, figure: Figure, panel: Panel) -> list[Drawn]:
        """Return a panel with its curves, and after it that of the difference, if there are two recordings.

        QuadvisError if a recording lacks a signal of it.
        """
        found = [self._curves(number, figure, panel) for number in range(len(self._recordings))]
        drawn = [(panel, [curve for curves in found for curve in curves])]
        if len(found) == 2 and panel.against is None:
            drawn.append(self._difference(panel, *found))
        return drawn

    def _curves(self, number: int, figure: Figure, panel: Panel) -> list[Curve]:
        name, recorded = self._recordings[number]
        if len(self._recordings) == 1:
            return panel_curves(recorded, figure, panel)
        try:
            curves = panel_curves(recorded, figure, self._there(number, panel))
        except QuadvisError as error:
            raise QuadvisError(f"{name}: {error}") from error
        return [replace(each, label=f"{each.label} ({name})", recording=number) for each in curves]

    def _there(self, number: int, panel: Panel) -> Panel:
        """Return a panel of the first recording as it is of another one."""
        first, other = self._recordings[0][1], self._recordings[number][1]
        if not number or not isinstance(first, Recording) or not isinstance(other, Recording):
            return panel
        return with_signals(panel, lambda wire: counterpart(wire, first, other))

    def _difference(self, panel: Panel, first: list[Curve], second: list[Curve]) -> Drawn:
        """Return the second less the first, element by element, and where both have samples."""
        names = [name for name, _ in self._recordings]
        head = f"{names[1]} less {names[0]}"
        title = f"{panel.title}: {head}" if panel.title else head
        curves = [_less(*pair) for pair in zip(second, first, strict=False)]
        return Panel(panel.traces, title, panel.unit, 0.0), curves


def counterpart(wire: Wire, first: Recording, other: Recording) -> Wire:
    """Return what a signal of one recording is in another, whose parts may be made of other blocks.

    A signal that a part gives is what this part gives there, the outermost part first; any other has its own
    name. QuadvisError if there is none.
    """
    given = sorted((port for port, source in first.ports.items() if source == wire.source), key=len)
    name = next((port for port in given if port in other), wire.source)
    return other.wire(name + index_text(wire.index))


def _less(minuend: Curve, subtrahend: Curve) -> Curve:
    """Return the difference of two curves at the times of both."""
    times = np.union1d(minuend.times, subtrahend.times)
    scale = subtrahend.unit.scale / minuend.unit.scale
    values = values_at(minuend, times) - values_at(subtrahend, times) * scale
    within = np.isfinite(values)
    label = minuend.label.rpartition(" (")[0]
    return replace(
        minuend, label=label, times=times[within], values=values[within], before=np.nan, recording=0
    )


def short_names(paths: Sequence[Path]) -> list[str]:
    """Return names that tell files apart: those of the files, with as many folders as are needed."""
    parts = [Path(os.path.abspath(path)).with_suffix("").parts for path in paths]
    for count in range(1, max(map(len, parts), default=1) + 1):
        names = ["/".join(each[-count:]) for each in parts]
        if len(set(names)) == len(set(paths)):
            return names
    return [str(path) for path in paths]
