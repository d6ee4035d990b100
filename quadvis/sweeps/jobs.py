"""The runs of a sweep as jobs: the diagram, the settings and the seed of each."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import islice
from pathlib import Path

import numpy as np

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.settings import settings_origin
from quadvis.errors import DiagramError, Fault, Place, QuadvisError
from quadvis.errors.caller import as_given
from quadvis.library.catalogue import OwnBlocks
from quadvis.sweeps.axes import NONE, PARAMS, SEED, VARIANT, AnyAxis, Axis
from quadvis.sweeps.designs import Design
from quadvis.sweeps.worker import Configuration, Job

CHECKED = 50  # values that are checked at each end of an axis
TOGETHER = 1000  # jobs that are made at once
NOT_SET = (SEED, VARIANT, PARAMS)  # axes that are not parameters of the diagram


class Jobs:
    """Makes the jobs for the workers from the design of a sweep."""

    def __init__(self, design: Design, base: Configuration, seed: int | None, own_blocks: OwnBlocks) -> None:
        self.design, self.base, self.seed = design, base, seed
        self.inputs: set[Path] = set()  # the files on which the runs depend, as far as diagrams were loaded
        self.files: dict[str, str] = {}  # SHA-256 of the files of the diagrams, by path
        self.own_blocks = own_blocks

    def _values(self, places: Sequence[float]) -> dict[str, str]:
        """Return the values at places by the names of the axes, without those of the diagram's own."""
        pairs = zip(self.design.axes, places, strict=True)
        return {axis.name: axis.text(place) for axis, place in pairs if not math.isnan(place)}

    def configuration(self, places: Sequence[float]) -> Configuration:
        """Return the diagram at places on the axes."""
        values = self._values(places)
        base = self.base
        variant, file = values.get(VARIANT, base.variant), values.get(PARAMS, NONE)
        own = tuple(f"{name}={text}" for name, text in values.items() if name not in NOT_SET)
        return Configuration(
            base.file,
            None if variant == NONE else variant,
            base.settings + own,
            base.params if file == NONE else (*base.params, file),
            base.stop_time,
            base.own_blocks,
        )

    @property
    def named(self) -> list[Path]:
        """The parameter files among the values of the axes, also those that were not loaded."""
        files = [axis for axis in self.design.axes if axis.name == PARAMS and isinstance(axis, Axis)]
        return [Path(value) for axis in files for value in axis.values if value != NONE]

    def check(self) -> Diagram:
        """Load the diagram with each value of each axis, others as in the first run; return the first one.

        Of a long axis only the values at the ends are checked, of a distribution the least and the greatest;
        a fault of another value becomes a row of the table.
        """
        first = self.design.places([0])[0].tolist()
        diagram = self._load(first, first)
        for number, axis in enumerate(self.design.axes):
            for place in self._checked(number, axis):
                if place != first[number]:
                    self._load([*first[:number], place, *first[number + 1 :]], first)
        return diagram

    def _checked(self, number: int, axis: AnyAxis) -> list[float]:
        if isinstance(axis, Axis):
            count = len(axis.values) if axis.name != SEED else 1
            return sorted({*range(min(count, CHECKED)), *range(max(0, count - CHECKED), count)})
        drawn = self.design.places(range(self.design.runs))[:, number]
        return [float(np.nanmin(drawn)), float(np.nanmax(drawn))]

    def _load(self, places: Sequence[float], first: Sequence[float]) -> Diagram:
        try:
            diagram = self.configuration(places).load(self.own_blocks)
            self.inputs.update(diagram.inputs)
            for path, digest in diagram.files.items():
                if self.files.setdefault(path, digest) != digest:
                    raise QuadvisError(f"'{path}' was changed while it was being read; sweep again")
            return diagram
        except DiagramError as error:
            found = DiagramError(self._placed(fault, places) for fault in error.faults)
            if str(found) == str(error):  # no fault names the value and the axis that caused it
                for axis, place, usual in zip(self.design.axes, places, first, strict=True):
                    if place != usual and not math.isnan(place) and axis.name not in NOT_SET:
                        found.add_note(f"with {_origin(axis, place)}")
            raise found from None

    def _placed(self, fault: Fault, places: Sequence[float]) -> Fault:
        """Return the fault; a fault of an axis's value gets the place where the value was given."""
        for axis, place in zip(self.design.axes, places, strict=True):
            parameter = axis.name.rpartition(".")[2]
            is_set = fault.place.file == settings_origin() and axis.name not in NOT_SET
            if is_set and parameter in str(fault) and not math.isnan(place):
                return replace(fault, place=Place(_origin(axis, place)))
        return fault

    def jobs(self, rows: Iterable[int], folder: Path | None, engine: str) -> Iterator[Job]:
        """Yield these runs, each with this engine; with a folder for their logs."""
        for some in _batches(rows):
            for row, places in zip(some, self.design.places(some).tolist(), strict=True):
                values = self._values(places)
                seed = int(values[SEED]) if SEED in values else self.seed
                log = str(folder / f"{self._log_name(row, places)}.mcap") if folder else None
                yield Job(row, self.configuration(places), seed, log, engine, self.files)

    def _log_name(self, row: int, places: Sequence[float]) -> str:
        """Return the name of a log: the number of the row and the values of the axes."""
        pairs = zip(self.design.axes, places, strict=True)
        values = [f"{axis.name}={axis.label(place)}" for axis, place in pairs if not math.isnan(place)]
        digits = len(str(self.design.runs - 1))
        return re.sub(r"[^A-Za-z0-9_.=-]+", "-", "-".join([f"{row:0{digits}}", *values]))[:120]


def _batches(rows: Iterable[int]) -> Iterator[list[int]]:
    left = iter(rows)
    while some := list(islice(left, TOGETHER)):
        yield some


def _origin(axis: AnyAxis, place: float) -> str:
    """Return where a value of an axis was given."""
    return f"{as_given('--over', 'over')} {axis.name}={axis.text(place)}"
