"""One run of a sweep, as a worker process does it: it depends on file, settings and seed alone."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from multiprocessing import parent_process
from typing import TYPE_CHECKING

from quadvis.errors import QuadvisError
from quadvis.machine.interrupts import leave_to_parent
from quadvis.output.statistics import COUNT, FINAL

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.diagram.requirements import Selection
    from quadvis.library.catalogue import OwnBlocks
    from quadvis.run.verdict import Outcome

# Where runs share the processors, threads inside a run only take turns.
ONE_THREAD = dict.fromkeys(
    (
        "MKL_NUM_THREADS",
        "NUMBA_NUM_THREADS",
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "OPENCV_FOR_THREADS_NUM",
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)


@dataclass(frozen=True)
class Configuration:
    """A diagram as it is to be loaded; the runs of one configuration differ in their seeds alone."""

    file: str
    variant: str | None = None
    settings: tuple[str, ...] = ()
    params: tuple[str, ...] = ()
    stop_time: str | float | None = None
    own_blocks: bool = True

    def load(self, own_blocks: OwnBlocks = True) -> Diagram:
        """Return the diagram; DiagramError tells its faults. ``own_blocks`` may be told what is run."""
        from quadvis.diagram.load import load

        return load(
            self.file,
            variant=self.variant,
            settings=self.settings,
            params=self.params,
            stop_time=self.stop_time,
            own_blocks=self.own_blocks and own_blocks,
        )


@dataclass(frozen=True)
class Job:
    """One run: ``index`` is its row in the table, ``seed`` None stands for the diagram's.

    ``files`` has the SHA-256 of the files that the sweep began with, by path.
    """

    index: int
    configuration: Configuration
    seed: int | None = None
    log: str | None = None
    files: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Quantity:
    """A number that every run gives: a statistic of the summary, or what an expectation looks at.

    ``limit`` is what an expectation demands of this very number, in the same unit.
    """

    label: str
    unit: str = ""
    limit: float | None = None
    summary: bool = True

    @property
    def column(self) -> str:
        """The name of its column."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


@dataclass(frozen=True)
class Row:
    """What one run gave; no numbers if it stopped with an error.

    ``failure`` says why it stopped, or what its log lacks: then it should be run again.
    """

    index: int
    hash: str = ""
    units: tuple[str, ...] = ()
    numbers: tuple[float, ...] = ()
    passed: bool = False
    failure: str = ""
    wall: float = float("nan")


def quantities(diagram: Diagram) -> list[Quantity]:
    """Return what the runs of a diagram give, in the order of `numbers`; of vectors one for each element."""
    found = [
        Quantity(
            f"{entry.label}.{name}{element}",
            _unit(entry.selection, name),
            _limit(diagram, entry.selection, name),
        )
        for entry in diagram.summary
        for name in entry.show
        for element in (entry.selection.elements if name == FINAL else ("",))
    ]
    for expectation in diagram.expectations:
        selection, name = expectation.selection, expectation.statistic
        limit = expectation.limit * _scale(selection, name)
        found.append(Quantity(str(expectation), _unit(selection, name), limit, summary=False))
    return found


def numbers(diagram: Diagram, outcome: Outcome) -> list[float]:
    """Return what a run gave, in the units in which people read it."""
    found = []
    for entry in diagram.summary:
        for name in entry.show:
            value = outcome.summary[entry.label][name]
            values = value if isinstance(value, tuple) else (value,)
            found += [each * _scale(entry.selection, name) for each in values]
    for verdict in outcome.verdicts:
        found.append(verdict.found * _scale(verdict.expectation.selection, verdict.expectation.statistic))
    return found


def _unit(selection: Selection, statistic: str) -> str:
    return str(selection.shown) if selection.shown.symbols and statistic != COUNT else ""


def _scale(selection: Selection, statistic: str) -> float:
    return 1.0 if statistic == COUNT else selection.unit.scale / selection.shown.scale


def _limit(diagram: Diagram, selection: Selection, statistic: str) -> float | None:
    """Return what is expected of a number of the summary, if an expectation is about the same."""
    for expectation in diagram.expectations:
        same = replace(expectation.selection, shown=selection.shown, text=selection.text) == selection
        if same and expectation.statistic == statistic:
            return expectation.limit * _scale(selection, statistic)
    return None


_loaded: tuple[Configuration, Diagram] | None = None


def begin() -> None:
    """Prepare a worker process."""
    leave_to_parent()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End when the first process has gone, however it ended: nobody is left to take the results."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def perform(job: Job) -> Row:
    """Do one run. What is wrong with it, or stops it, becomes its row."""
    from quadvis.run.session import run

    digest = ""
    try:
        diagram = diagram_of(job)
        digest = diagram.hash
        result = run(diagram, log=job.log, keep=())
    except QuadvisError as error:
        return Row(job.index, digest, failure=" | ".join(str(error).splitlines()))
    units = tuple(quantity.unit for quantity in quantities(diagram))
    found = tuple(numbers(diagram, result.outcome))
    passed = result.passed and not result.lost
    return Row(job.index, digest, units, found, passed, result.lost, wall=result.wall)


def diagram_of(job: Job) -> Diagram:
    """Return the diagram of a run; it is read once for runs of one configuration that follow each other.

    QuadvisError if a file is not what it was when the sweep began: one table is about one diagram.
    """
    global _loaded
    if _loaded is None or _loaded[0] != job.configuration:
        loaded = job.configuration.load()
        for path, digest in loaded.files.items():
            if job.files.get(path, digest) != digest:
                raise QuadvisError(f"'{path}' is not what it was when the sweep began; sweep again")
        _loaded = job.configuration, loaded
    diagram = _loaded[1]
    return diagram if job.seed is None else replace(diagram, seed=job.seed)
