"""Many runs of one diagram in parallel processes: one table that depends only on the diagram."""

from __future__ import annotations

import os
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path

from quadvis.diagram.settings import Files, Given, value_text
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError
from quadvis.errors.caller import as_given
from quadvis.graph.devices import refuse_devices
from quadvis.library.catalogue import OwnBlocks
from quadvis.machine.files import PLOT, check_output
from quadvis.native.choice import AUTO, Announce, choose
from quadvis.sweeps.axes import GRID, PARAMS, SEED, VARIANT, AnyAxis, Over, read_axes
from quadvis.sweeps.collection import TableMaker
from quadvis.sweeps.designs import make_design
from quadvis.sweeps.jobs import Jobs
from quadvis.sweeps.parts import PartedSaving, sweep_key
from quadvis.sweeps.pool import perform_all, processors
from quadvis.sweeps.saving import Saving
from quadvis.sweeps.stop_rule import StopRule
from quadvis.sweeps.table import Table
from quadvis.sweeps.worker import Configuration, Job, Row, quantities

MOST_IN_FILE = 100_000  # runs of a table that is one file; a larger one is a folder

Progress = Callable[[int, int, int], None]  # takes the numbers of runs: finished, all, not passed


class IfAny(str):
    """The file of a picture that is left out if the runs have no numbers to draw."""


def sweep(
    path: str | Path,
    over: Over,
    *,
    design: str = GRID,
    runs: int | None = None,
    until: str | None = None,
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
    sensitivity: str | Path | None = None,
    logs: str | Path | None = None,
    own_blocks: OwnBlocks = True,
    engine: str = AUTO,
    announce: Announce | None = None,
    progress: Progress | None = None,
) -> Table:
    """Run a diagram many times, and return a table of the results.

    ``over`` maps each axis to its values: ``{"seed": range(30), "craft.lag": ["20 ms", "50 ms"], "bandwidth":
    "1..3 step 0.5 rad/s"}``, or is a list of texts such as ``seed=0..29``. An axis is a parameter, named as
    in ``settings``, or ``seed``, ``variant`` or ``params``. All combinations are run, as a grid; the last
    axis changes fastest. Another ``design`` of `designs.DESIGNS` has ``runs`` of its own, and axes of any
    value, too: ranges such as "1..4 rad/s", and distributions of `continuous.KINDS`, such as "normal(0.5 kg,
    20 g)". It is drawn with ``seed``, 0 if there is none. ``until`` ends the sweep early, see `StopRule`:
    "failing within 2 %". The other arguments are those of `quadvis.load`, for every run.

    ``workers`` processes share the runs (by default one for each processor); the table is the same to the bit
    for any number of workers. It is written to ``output`` (.csv or .parquet). If the sweep is interrupted, or
    a worker (RunError) or this process is killed, the file keeps all finished runs but those of the last two
    seconds (of a large .parquet, which takes long to write, some more). A .parquet of more than 100,000 runs,
    or whose name ends in "/", is a folder of parts; its table reads a column when it is asked for.
    ``cluster`` is the address of a scheduler of Dask, such as ``tcp://host:8786``: its workers do the runs,
    have the same quadvis, and get the files. ``resume`` takes over the runs of ``output`` with the same hash,
    and does the others. ``plot`` is the file for a picture of the summary (PNG), ``sensitivity`` one for how
    much of the spread is due to each axis, ``logs`` a folder for a log of every run. ``engine`` and
    ``announce`` are as in `Diagram.run`; what has to be compiled is compiled before the workers begin.

    A run that stops with an error is a row that says so. QuadvisError if a value does not fit the diagram, or
    if a file cannot be written because it is an input, another kind of file, or the output of another sweep.
    """
    axes, processes = read_axes(over, design), _workers(workers, cluster)
    if cluster and logs:
        taken = as_given("--logs", "logs")
        raise QuadvisError(f"the workers of a cluster write no logs here; leave {taken} out, or the cluster")
    _refuse_conflicts(axes, variant, settings, seed if design == GRID else None)
    drawn = make_design(axes, design, runs, seed or 0)
    if sensitivity is not None:
        from quadvis.sweeps.sensitivity import refuse_unfit

        refuse_unfit(drawn)
    large = _refuse_large(output, drawn.runs)
    given = (str(path), variant, setting_texts(settings), setting_paths(params), stop_time, bool(own_blocks))
    made = Jobs(drawn, Configuration(*given), seed, own_blocks)
    diagram = made.check()
    for picture in (plot, sensitivity):
        if picture is not None:
            check_output(picture, PLOT, made.inputs)
    refuse_devices(diagram.graph)
    found = quantities(diagram)
    if not found:
        plot = None if isinstance(plot, IfAny) else plot
        _refuse_pictures(plot, sensitivity)
    rule = StopRule(until, found, drawn) if until is not None else None
    make = TableMaker(diagram.name, drawn, found, len(diagram.loop_requirements))
    chosen = choose(Engine(diagram.graph), diagram.ticks * drawn.runs, engine, announce).engine
    several = any(axis.name in (VARIANT, PARAMS) for axis in axes)  # block types may differ from run to run
    with _saving(make, rule, output, large, timings, made, diagram.hash) as saving:
        jobs = saving.jobs(made, _folder(logs), engine if several else chosen, resume)
        collection = saving.collection
        try:
            with closing(_performed(jobs, processes, cluster, made)) as rows:
                for row in rows:
                    if row is not None:
                        collection.add(row)
                        if progress:
                            progress(collection.finished, drawn.runs, collection.failed)
                    saving.now_and_then()
                    if collection.enough:
                        break
            collection.drop_surplus()
        except BaseException as error:
            kept = output is not None and collection.finished
            words = f" and in {output}; {as_given('--resume', 'resume=True')} does the rest" if kept else ""
            error.add_note(f"{collection.finished} of {drawn.runs} runs are finished{words}")
            raise
    table = saving.table()
    table.note = rule.words if rule is not None else ""
    if plot is not None:
        from quadvis.sweeps.picture import draw  # a sweep without a plot does not wait for this import

        draw(table, Path(plot), made.inputs)
    if sensitivity is not None:
        from quadvis.sweeps.sensitivity_plot import draw_sensitivity

        draw_sensitivity(table, Path(sensitivity), made.inputs)
    return table


def _refuse_pictures(plot: str | Path | None, sensitivity: str | Path | None) -> None:
    """Refuse pictures of a sweep whose runs have no numbers."""
    for picture, option in ((plot, "plot"), (sensitivity, "sensitivity")):
        if picture is not None:
            problem = f"{as_given(f'--{option}', option)} has nothing to draw"
            raise QuadvisError(
                f"{problem}: the diagram has neither 'summary' nor 'expect'; give it a summary"
            )


def _refuse_large(output: str | Path | None, runs: int) -> bool:
    """Return whether the table is a folder; QuadvisError if it has to be one, and cannot."""
    is_parquet = Path(output or "").suffix == ".parquet"
    if runs > MOST_IN_FILE and not is_parquet:
        problem = f"the table of {runs} runs is too large for memory and for one file"
        raise QuadvisError(f"{problem}; give {as_given('-o', 'output')} a name that ends in .parquet")
    return runs > MOST_IN_FILE or (is_parquet and (str(output).endswith("/") or Path(str(output)).is_dir()))


def _saving(
    make: TableMaker,
    rule: StopRule | None,
    output: str | Path | None,
    large: bool,
    timings: bool,
    made: Jobs,
    diagram_hash: str,
) -> Saving | PartedSaving:
    """Take the file, or the folder, of the table; QuadvisError if it cannot be written."""
    path = Path(output) if output else None
    if path is None or not large:
        return Saving(make, rule, path, timings, made.inputs)
    key = sweep_key(made, diagram_hash, [quantity.column for quantity in make.quantities])
    return PartedSaving(make, rule, path, timings, made.inputs, key)


def setting_texts(settings: Given) -> tuple[str, ...]:
    """Return settings as the texts of ``--set``."""
    if isinstance(settings, Mapping):
        return tuple(f"{name}={value_text(value)}" for name, value in settings.items())
    return tuple(settings)


def setting_paths(params: Files) -> tuple[str, ...]:
    """Return the paths of parameter files."""
    return (str(params),) if isinstance(params, str | os.PathLike) else tuple(map(str, params))


def _performed(
    jobs: Iterator[Job], processes: int, cluster: str | None, made: Jobs
) -> Generator[Row | None, None, None]:
    """Do the jobs, here or on a cluster."""
    if cluster is None:
        return perform_all(jobs, min(processes, made.design.runs))
    from quadvis.sweeps.cluster import perform_on  # what it needs takes a while

    return perform_on(cluster, jobs, made.design.runs, [*made.inputs, *made.named])


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


def _refuse_conflicts(
    axes: Sequence[AnyAxis], variant: str | None, settings: Given, seed: int | None
) -> None:
    """Refuse an axis that also has a fixed value; an axis of parameter files is added to the given files."""
    names = {text.partition("=")[0].strip() for text in setting_texts(settings)}
    names |= {SEED} if seed is not None else set()
    names |= {VARIANT} if variant is not None else set()
    for axis in axes:
        if axis.name in names:
            raise QuadvisError(f"'{axis.name}' is swept over and given a value as well; keep one of them")
