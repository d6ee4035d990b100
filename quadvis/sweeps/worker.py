"""One run of a sweep in a worker process: it depends only on file, settings and seed."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from multiprocessing import parent_process
from typing import TYPE_CHECKING

from quadvis.errors import QuadvisError
from quadvis.errors.caller import IS_COMMAND
from quadvis.machine.garbage import uncollected_at_exit
from quadvis.machine.interrupts import leave_to_parent
from quadvis.output.statistics import COUNT, FINAL

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.diagram.requirements import Selection
    from quadvis.library.catalogue import OwnBlocks
    from quadvis.run.verdict import Outcome


@dataclass(frozen=True)
class Configuration:
    """A file and its settings, from which a diagram is loaded; its runs differ only in their seeds."""

    file: str
    variant: str | None = None
    settings: tuple[str, ...] = ()
    params: tuple[str, ...] = ()
    stop_time: str | float | None = None
    own_blocks: bool = True

    def load(self, own_blocks: OwnBlocks = True) -> Diagram:
        """Return the diagram; DiagramError reports its faults. ``own_blocks`` as in `quadvis.load`."""
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
    """One run: ``index`` is its row in the table; ``seed`` None means the diagram's seed.

    ``files`` holds the SHA-256 of files at the start of the sweep, by path.
    """

    index: int
    configuration: Configuration
    seed: int | None = None
    log: str | None = None
    engine: str = "auto"
    files: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Quantity:
    """A number that every run gives: a statistic of the summary, or the value found for an expectation.

    ``limit`` is the limit of an expectation of this very number, in the same unit; ``kind`` is the
    expectation's, for a number that is its own.
    """

    label: str
    unit: str = ""
    limit: float | None = None
    summary: bool = True
    kind: str = ""

    def holds(self, value: float) -> bool:
        """Return whether the expectation is met by its number; a run without one does not meet it."""
        from quadvis.diagram.requirements import EXPECTATIONS

        return self.limit is not None and EXPECTATIONS[self.kind].holds(value, self.limit)

    @property
    def column(self) -> str:
        """The name of the quantity's column."""
        return f"{self.label} [{self.unit}]" if self.unit else self.label


@dataclass(frozen=True)
class Row:
    """The results of one run; without numbers if it stopped with an error.

    ``failure`` says why it stopped, or what its log lacks; then the run should be repeated.
    """

    index: int
    hash: str = ""
    units: tuple[str, ...] = ()
    numbers: tuple[float, ...] = ()
    passed: bool = False
    failure: str = ""
    wall: float = float("nan")


def quantities(diagram: Diagram) -> list[Quantity]:
    """Return the quantities of a diagram's runs, in the order of `numbers`; of vectors one per element."""
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
        unit = _unit(selection, name)
        found.append(Quantity(str(expectation), unit, limit, summary=False, kind=expectation.kind))
    return found


def numbers(diagram: Diagram, outcome: Outcome) -> list[float]:
    """Return the numbers of a run, in the units of texts."""
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
    """Return the limit of a number of the summary, if an expectation judges the same number."""
    for expectation in diagram.expectations:
        same = replace(expectation.selection, shown=selection.shown, text=selection.text) == selection
        if same and expectation.statistic == statistic:
            return expectation.limit * _scale(selection, statistic)
    return None


_loaded: tuple[tuple[str, Configuration, Mapping[str, str]], Diagram] | None = None


def begin(is_command: bool) -> None:
    """Prepare a worker process, for a sweep that a command or Python has asked for."""
    IS_COMMAND.set(is_command)
    leave_to_parent()
    uncollected_at_exit()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    """End this process when the first one has ended, because nobody is left to take the results."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def perform(job: Job) -> Row:
    """Do one run. A fault of the diagram, or an error that stops the run, becomes its row."""
    from quadvis.run.session import run

    digest = ""
    try:
        diagram = diagram_of(job)
        digest = diagram.hash
        result = run(diagram, log=job.log, keep=(), engine=job.engine)
    except QuadvisError as error:
        return Row(job.index, digest, failure=" | ".join(str(error).splitlines()))
    units = tuple(quantity.unit for quantity in quantities(diagram))
    found = tuple(numbers(diagram, result.outcome))
    passed = result.passed and not result.lost
    return Row(job.index, digest, units, found, passed, result.lost, wall=result.wall)


def diagram_of(job: Job) -> Diagram:
    """Return the diagram of a run; successive runs of one configuration, directory and files share it.

    QuadvisError if a file has changed since the sweep began, because one table is about one diagram.
    """
    global _loaded
    asked = os.getcwd(), job.configuration, job.files
    if _loaded is None or _loaded[0] != asked:
        loaded = job.configuration.load()
        for path, digest in loaded.files.items():
            if job.files.get(path, digest) != digest:
                raise QuadvisError(f"'{path}' is not what it was when the sweep began; sweep again")
        _loaded = asked, loaded
    diagram = _loaded[1]
    return diagram if job.seed is None else replace(diagram, seed=job.seed)
