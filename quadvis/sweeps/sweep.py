"""Many runs of one diagram in parallel processes: one table that depends only on the diagram."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from quadvis.diagram.settings import Files, Given, value_text
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError, quoted
from quadvis.errors.caller import as_given
from quadvis.graph.devices import refuse_devices
from quadvis.library.catalogue import OwnBlocks
from quadvis.machine.files import PLOT, Claim, check_output
from quadvis.native.choice import AUTO, Announce, choose
from quadvis.sweeps.axes import PARAMS, SEED, VARIANT, Axis, Over, points, read_axes
from quadvis.sweeps.grid import Grid
from quadvis.sweeps.pool import perform_all, processors
from quadvis.sweeps.table import FAILURE, HASH, PASSED, WALL, Table, read_rows, table_kind
from quadvis.sweeps.worker import Configuration, Job, Quantity, Row, diagram_of, quantities

SAVE = 1.0  # s between two writings of finished runs

Progress = Callable[[int, int, int], None]  # takes the numbers of runs: finished, all, not passed


def sweep(
    path: str | Path,
    over: Over,
    *,
    variant: str | None = None,
    settings: Given = (),
    params: Files = (),
    stop_time: str | float | None = None,
    seed: int | None = None,
    workers: int | None = None,
    cluster: str | None = None,
    output: str | Path | None = None,
    timings: bool = False,
    resume: bool = False,
    plot: str | Path | None = None,
    logs: str | Path | None = None,
    own_blocks: OwnBlocks = True,
    engine: str = AUTO,
    announce: Announce | None = None,
    progress: Progress | None = None,
) -> Table:
    """Run a diagram at every point of a grid, and return a table of the results.

    ``over`` maps each axis to its values: ``{"seed": range(30), "craft.lag": ["20 ms", "50 ms"], "bandwidth":
    "1..3 step 0.5 rad/s"}``, or is a list of texts such as ``seed=0..29``. An axis is a parameter, named as
    in ``settings``, or ``seed``, ``variant`` or ``params``. With several axes all combinations are run; the
    last axis changes fastest. The other arguments are those of `quadvis.load`, for every run.

    ``workers`` processes share the runs (by default one for each processor); the table is the same to the bit
    for any number of workers. It is written to ``output`` (.csv or .parquet). If the sweep is interrupted, or
    a worker (RunError) or this process is killed, the file keeps all finished runs but those of the last two
    seconds. ``cluster`` is the address of a scheduler of Dask, such as ``tcp://host:8786``: its workers do
    the runs, have the same quadvis, and get the files. ``resume`` takes over the runs of ``output`` with the
    same hash, and does the others. ``plot`` is the file for a picture of the summary (PNG), ``logs`` a folder
    for a log of every run. ``engine`` and ``announce`` are as in `Diagram.run`; what has to be compiled is
    compiled before the workers begin.

    A run that stops with an error is a row that says so. QuadvisError if a value does not fit the diagram, or
    if a file cannot be written because it is an input, another kind of file, or the output of another sweep.
    """
    axes, processes = read_axes(over), _workers(workers, cluster)
    if cluster and logs:
        taken = as_given("--logs", "logs")
        raise QuadvisError(f"the workers of a cluster write no logs here; leave {taken} out, or the cluster")
    _refuse_conflicts(axes, variant, settings, seed)
    given = (str(path), variant, setting_texts(settings), setting_paths(params), stop_time, bool(own_blocks))
    places = points(axes)
    grid = Grid(axes, places, Configuration(*given), seed, own_blocks)
    diagram = grid.check()
    target = Path(output) if output else None
    if plot is not None:
        check_output(plot, PLOT, grid.inputs)
    refuse_devices(diagram.graph)
    found = quantities(diagram)
    chosen = choose(Engine(diagram.graph), diagram.ticks * len(places), engine, announce).engine
    several = any(axis.name in (VARIANT, PARAMS) for axis in axes)  # block types may differ from run to run
    jobs = list(grid.jobs(_folder(logs), engine if several else chosen))
    collection = _Collection(diagram.name, axes, places, found, len(diagram.loop_requirements))
    with _Saving(collection, target, timings, grid.inputs) as save:
        if resume and target is not None and target.stat().st_size:
            jobs = _not_known(jobs, _earlier(target, found), collection)
        try:
            with closing(_performed(jobs, processes, cluster, grid)) as rows:
                for row in rows:
                    if row is not None:
                        collection.add(row)
                        if progress:
                            progress(len(collection.rows), len(places), collection.failed)
                    save.now_and_then()
        except BaseException as error:
            error.add_note(f"{len(collection.rows)} of {len(places)} runs are finished{save.words}")
            raise
    table = collection.table()
    if plot is not None:
        from quadvis.sweeps.picture import draw  # a sweep without a plot does not wait for this import

        draw(table, Path(plot), grid.inputs)
    return table


class _Saving:
    """Writes finished rows to a file, if one is given: as they come, at the end in the grid's order."""

    def __init__(
        self, collection: _Collection, path: Path | None, timings: bool, inputs: Iterable[Path]
    ) -> None:
        self.collection, self.path, self.timings = collection, path, timings
        self.claim = None if path is None else Claim(path, table_kind(path), inputs)
        self.saved = 0  # rows
        self.last = time.monotonic()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self.claim is not None:
            with closing(self.claim):
                if self.collection.rows:
                    self.claim.write(self._content(self.collection.table()))

    @property
    def words(self) -> str:
        """The advice on how to continue a stopped sweep."""
        kept = self.path is not None and self.collection.rows
        return f" and in {self.path}; {as_given('--resume', 'resume=True')} does the rest" if kept else ""

    def now_and_then(self) -> None:
        """Append new rows if the last time is long enough ago; after `kill -9` these rows are left."""
        count = len(self.collection.rows)
        if self.claim is None or count == self.saved or time.monotonic() - self.last < SAVE:
            return
        if self.saved and self.claim.path.suffix == ".csv":
            self.claim.append(self._content(self.collection.table(self.saved), head=False))
        else:
            self.claim.write(self._content(self.collection.table()))
        self.saved, self.last = count, time.monotonic()

    def _content(self, table: Table, head: bool = True) -> bytes:
        assert self.path is not None
        return table.content(self.path.suffix, timings=self.timings, head=head)


def setting_texts(settings: Given) -> tuple[str, ...]:
    """Return settings as the texts of ``--set``."""
    if isinstance(settings, Mapping):
        return tuple(f"{name}={value_text(value)}" for name, value in settings.items())
    return tuple(settings)


def setting_paths(params: Files) -> tuple[str, ...]:
    """Return the paths of parameter files."""
    return (str(params),) if isinstance(params, str | os.PathLike) else tuple(map(str, params))


def _performed(
    jobs: Sequence[Job], processes: int, cluster: str | None, grid: Grid
) -> Generator[Row | None, None, None]:
    """Do the jobs, here or on a cluster."""
    if cluster is None:
        return perform_all(jobs, processes)
    from quadvis.sweeps.cluster import perform_on  # what it needs takes a while

    return perform_on(cluster, jobs, [*grid.inputs, *grid.named])


def _workers(given: int | None, cluster: str | None) -> int:
    if given is not None and cluster is not None:
        both = f"{as_given('--workers', 'workers')} and {as_given('--cluster', 'cluster')}"
        raise QuadvisError(f"{both} exclude each other: a cluster has its own workers")
    if given is not None and given < 1:
        raise QuadvisError(f"{given} worker processes cannot do anything; give 1 or more")
    return given or processors()


def _folder(logs: str | Path | None) -> Path | None:
    if not logs:
        return None
    try:
        Path(logs).mkdir(exist_ok=True)
    except OSError as error:
        raise QuadvisError(f"cannot make the folder '{logs}' for the logs: {error.strerror}") from error
    return Path(logs)


def _refuse_conflicts(axes: Sequence[Axis], variant: str | None, settings: Given, seed: int | None) -> None:
    """Refuse an axis that also has a fixed value; an axis of parameter files is added to the given files."""
    names = {text.partition("=")[0].strip() for text in setting_texts(settings)}
    names |= {SEED} if seed is not None else set()
    names |= {VARIANT} if variant is not None else set()
    for axis in axes:
        if axis.name in names:
            raise QuadvisError(f"'{axis.name}' is swept over and given a value as well; keep one of them")


def _not_known(jobs: Sequence[Job], earlier: Mapping[str, Row], collection: _Collection) -> list[Job]:
    """Take over the rows of an earlier table with the hash of a job's diagram; return the other jobs."""
    rest = []
    for job in jobs:
        try:
            row = earlier.get(diagram_of(job).hash)
        except QuadvisError:
            row = None  # the run will report the error
        if row is None:
            rest.append(job)
        else:
            collection.add(replace(row, index=job.index))
    return rest


def _earlier(path: Path, quantities: Sequence[Quantity]) -> dict[str, Row]:
    """Return the rows of an earlier table by hash, without runs that stopped with an error."""
    found = {}
    for cells in read_rows(path):
        names = (HASH, FAILURE, PASSED, *(quantity.column for quantity in quantities))
        if any(name not in cells for name in names):
            problem = f"cannot go on with '{path}': it is not a table of this sweep"
            raise QuadvisError(f"{problem}; leave {as_given('--resume', 'resume')} out to begin anew")
        if not cells[FAILURE]:
            numbers = tuple(_number(cells[quantity.column]) for quantity in quantities)
            units = tuple(quantity.unit for quantity in quantities)
            passed = cells[PASSED] in (True, "true")
            wall = _number(cells.get(WALL))
            found[cells[HASH]] = Row(0, cells[HASH], units, numbers, passed, wall=wall)
    return found


def _number(cell: Any) -> float:
    try:
        return float(cell) if cell not in (None, "") else math.nan
    except ValueError:
        raise QuadvisError(f"the table holds {quoted(cell)} in place of a number") from None


class _Collection:
    """The rows so far, and their table in the order of the grid."""

    def __init__(
        self,
        name: str,
        axes: Sequence[Axis],
        grid: Sequence[tuple[int, ...]],
        quantities: Sequence[Quantity],
        margins: int,
    ) -> None:
        self.name, self.axes, self.grid, self.quantities = name, axes, grid, quantities
        self.margins = margins
        self.units = tuple(quantity.unit for quantity in quantities)
        self.rows: dict[int, Row] = {}
        self.failed = 0

    def add(self, row: Row) -> None:
        """Add the row of one run."""
        if not row.failure and row.units != self.units:
            row = Row(row.index, row.hash, failure="its numbers have other units than those of the first run")
        self.rows[row.index] = row
        self.failed += not row.passed

    def table(self, after: int = 0) -> Table:
        """Return the table of the rows so far, without the first ``after`` rows that came."""
        rows = [self.rows[index] for index in sorted(list(self.rows)[after:])]
        indices = np.array([self.grid[row.index] for row in rows], np.int64).reshape(-1, len(self.axes))
        columns = {
            axis.column: axis.cells(indices[:, number].tolist()) for number, axis in enumerate(self.axes)
        }
        missing = (math.nan,) * len(self.quantities)
        numbers = np.array([row.numbers or missing for row in rows]).reshape(len(rows), -1)
        columns |= {quantity.column: numbers[:, number] for number, quantity in enumerate(self.quantities)}
        columns[PASSED] = np.array([row.passed for row in rows], np.bool_)
        columns[FAILURE] = np.array([row.failure for row in rows], np.str_)
        columns[HASH] = np.array([row.hash for row in rows], np.str_)
        wall = np.array([row.wall for row in rows], np.float64)
        return Table(self.name, self.axes, self.quantities, indices, columns, wall, self.margins)
