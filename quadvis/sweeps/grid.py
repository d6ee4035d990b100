"""The grid of a sweep: the diagram, the settings and the seed of each run, as jobs."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.settings import settings_origin
from quadvis.errors import DiagramError, Fault, Place, QuadvisError
from quadvis.errors.caller import as_given
from quadvis.library.catalogue import OwnBlocks
from quadvis.sweeps.axes import NONE, PARAMS, SEED, VARIANT, Axis
from quadvis.sweeps.worker import Configuration, Job

CHECKED = 50  # values that are checked at each end of an axis
NOT_SET = (SEED, VARIANT, PARAMS)  # axes that are not parameters of the diagram


class Grid:
    """The grid of a sweep, which makes the jobs for the workers."""

    def __init__(
        self,
        axes: Sequence[Axis],
        points: Sequence[tuple[int, ...]],
        base: Configuration,
        seed: int | None,
        own_blocks: OwnBlocks,
    ) -> None:
        self.axes, self.points, self.base, self.seed = axes, points, base, seed
        self.inputs: set[Path] = set()  # the files on which the runs depend, as far as diagrams were loaded
        self.files: dict[str, str] = {}  # SHA-256 of the files of the diagrams, by path
        self.own_blocks = own_blocks

    def configuration(self, point: Sequence[int]) -> Configuration:
        """Return the diagram at a point of the grid."""
        values = {axis.name: axis.values[index] for axis, index in zip(self.axes, point, strict=True)}
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
        values = [value for axis in self.axes if axis.name == PARAMS for value in axis.values]
        return [Path(value) for value in values if value != NONE]

    def check(self) -> Diagram:
        """Load the diagram with each value of each axis, other axes at their first; return the first diagram.

        Of a long axis only the values at the ends are checked; a fault of another value becomes a row of the
        table.
        """
        first = [0] * len(self.axes)
        diagram = self._load(first)
        for number, axis in enumerate(self.axes):
            count = len(axis.values) if axis.name != SEED else 1
            for index in sorted({*range(1, min(count, CHECKED)), *range(max(1, count - CHECKED), count)}):
                self._load([*first[:number], index, *first[number + 1 :]])
        return diagram

    def _load(self, point: Sequence[int]) -> Diagram:
        try:
            diagram = self.configuration(point).load(self.own_blocks)
            self.inputs.update(diagram.inputs)
            for path, digest in diagram.files.items():
                if self.files.setdefault(path, digest) != digest:
                    raise QuadvisError(f"'{path}' was changed while it was being read; sweep again")
            return diagram
        except DiagramError as error:
            found = DiagramError(self._placed(fault, point) for fault in error.faults)
            if str(found) == str(error):  # no fault names the value and the axis that caused it
                for axis, index in zip(self.axes, point, strict=True):
                    if index and axis.name not in NOT_SET:
                        found.add_note(f"with {_origin(axis, index)}")
            raise found from None

    def _placed(self, fault: Fault, point: Sequence[int]) -> Fault:
        """Return the fault; a fault of an axis's value gets the place where the value was given."""
        for axis, index in zip(self.axes, point, strict=True):
            parameter = axis.name.rpartition(".")[2]
            is_set = fault.place.file == settings_origin() and axis.name not in NOT_SET
            if is_set and parameter in str(fault):
                return replace(fault, place=Place(_origin(axis, index)))
        return fault

    def jobs(self, folder: Path | None, engine: str) -> Iterator[Job]:
        """Yield all runs in the order of the table, each with this engine."""
        for row, point in enumerate(self.points):
            chosen = {axis.name: index for axis, index in zip(self.axes, point, strict=True)}
            seeds = next((axis.values for axis in self.axes if axis.name == SEED), ())
            seed = int(seeds[chosen[SEED]]) if seeds else self.seed
            log = str(folder / f"{self._log_name(row, point)}.mcap") if folder else None
            yield Job(row, self.configuration(point), seed, log, engine, self.files)

    def _log_name(self, row: int, point: Sequence[int]) -> str:
        """Return the name of a log: the number of the row and the values of the axes."""
        values = [f"{axis.name}={axis.label(index)}" for axis, index in zip(self.axes, point, strict=True)]
        digits = len(str(len(self.points) - 1))
        return re.sub(r"[^A-Za-z0-9_.=-]+", "-", "-".join([f"{row:0{digits}}", *values]))[:120]


def _origin(axis: Axis, index: int) -> str:
    """Return where a value of an axis was given."""
    return f"{as_given('--over', 'over')} {axis.name}={axis.values[index]}"
