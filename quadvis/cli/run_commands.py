"""The commands that run a diagram, or read what a run has left. Each returns the exit code."""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.cli.default_places import default_name, log_path, runs_folder
from quadvis.cli.given import FAILED, YAML, load_diagram, own_blocks
from quadvis.cli.shown import plain_faults, print_json, print_warnings, terminal_width
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.files import Kind, check_output, file_name, write_output
from quadvis.machine.garbage import collected_from_now_on

if TYPE_CHECKING:
    from quadvis.realtime.options import RealTime

PARAMETERS = Kind("the parameter file", (b"#", b"quadvis:"), rb"^set:")


def run(options: argparse.Namespace) -> int:
    """Run a diagram and print the summary; 1 if the run misses an expectation."""
    from quadvis.machine.status_line import ProgressLine
    from quadvis.run.report import summary_lines
    from quadvis.run.session import run as run_diagram
    from quadvis.run.trace import TRACE

    if options.target is not None or options.on:
        from quadvis.cli.run_on_target import check_options, run_on_several, run_on_target

        check_options(options)
    real_time = _real_time(options)
    diagram = load_diagram(options, stop_time=options.stop_time, seed=options.seed)
    if options.profile:
        check_output(options.profile, TRACE, diagram.inputs)
    log = log_path(options.log, diagram)
    print_warnings(diagram, options)
    if options.target is not None:
        return run_on_target(diagram, log, options)
    if options.on:
        return run_on_several(diagram, log, options)
    collected_from_now_on()
    try:
        with ProgressLine(diagram.duration) as progress:
            result = run_diagram(
                diagram, log=log, progress=progress, keep=(), engine=options.engine, announce=progress.say,
                real_time=real_time, profile=options.profile is not None,
            )  # fmt: skip
    except (RunError, KeyboardInterrupt):
        if log is not None and log.is_file():
            print(f"log up to there: {log}", file=sys.stderr)
        raise
    if options.json:
        outputs = {"log": str(log) if log else None, "lost": result.lost or None}
        print_json(result.facts() | outputs | {"warnings": plain_faults(diagram.warnings)})
    else:
        print("\n".join(summary_lines(result)))
        if log:
            print(f"log: {log}")
    if result.lost:
        print(f"{result.lost}; the run itself is judged in full", file=sys.stderr)
    if options.profile:
        from quadvis.run.trace import write_trace

        write_trace(options.profile, result.profiles)
        print(f"trace: {options.profile}", file=sys.stderr)
    for complaint in result.flight.complaints if result.flight else ():
        print(complaint, file=sys.stderr)
    return 0 if result.passed and not result.lost else FAILED


def _real_time(options: argparse.Namespace) -> RealTime | None:
    """Return what a real-time run is to ask for; None for a simulation."""
    chosen = {name: getattr(options, name) for name in ("cpu", "priority", "poll")}
    given = {name: value for name, value in chosen.items() if value is not None}
    if given and not options.real_time:
        raise QuadvisError(f"--{next(iter(given))} is for a real-time run; add --real-time")
    if not options.real_time:
        return None
    from quadvis.realtime.options import RealTime

    return RealTime(**given)


def replay(options: argparse.Namespace) -> int:
    """Repeat the run of a log; 1 if it differs, unless a parameter was replaced."""
    from quadvis.machine.status_line import ProgressLine
    from quadvis.output.log_reader import read_log
    from quadvis.run.replay import replay as run_again
    from quadvis.run.replay_report import replay_facts, replay_lines

    log = read_log(options.log)
    collected_from_now_on()
    with ProgressLine(log.end or 0.0) as progress:
        found = run_again(
            log, settings=options.set, output=options.output, folder=options.folder, engine=options.engine,
            progress=progress, announce=progress.say, own_blocks=own_blocks(options),
        )  # fmt: skip
    if options.json:
        print_json(replay_facts(found))
    else:
        print("\n".join(replay_lines(found)))
        if found.output:
            print(f"log: {found.output}")
    if found.lost:
        print(found.lost, file=sys.stderr)
    return 0 if (found.same or options.set) and not found.lost else FAILED


def sweep(options: argparse.Namespace) -> int:
    """Run a diagram many times, with the values of a design; 1 if a run fails."""
    from quadvis.sweeps.summary import SweepLine, read_quantiles, sweep_lines
    from quadvis.sweeps.sweep import IfAny
    from quadvis.sweeps.sweep import sweep as run_sweep

    several = len(options.variant) > 1
    over = [f"variant={','.join(options.variant)}"] * several + options.over
    one = None if several else next(iter(options.variant), None)
    name = f"{default_name(options, one)}-sweep.csv"
    table_path = Path(options.output or runs_folder("table", "-o") / name)
    quantiles = read_quantiles(options.quantiles) if options.quantiles is not None else None
    beside = IfAny(table_path.parent / f"{table_path.stem}.png")
    plot: str = beside if options.plot is None else options.plot
    if plot and Path(plot).suffix != ".png":
        raise QuadvisError(f"cannot write the plot '{plot}': give a name that ends in .png")
    if options.sensitivity is not None and Path(options.sensitivity).suffix != ".png":
        raise QuadvisError(f"cannot write the plot '{options.sensitivity}': give a name that ends in .png")
    collected_from_now_on()
    with SweepLine() as progress:
        table = run_sweep(
            options.file, over, design=options.design, runs=options.runs, until=options.until, variant=one,
            settings=options.set, params=options.params, stop_time=options.stop_time, seed=options.seed,
            workers=options.workers, cluster=options.cluster, output=options.output or table_path,
            timings=options.timings, resume=options.resume,
            engine=options.engine, announce=progress.say,
            plot=plot or None, sensitivity=options.sensitivity, logs=options.logs,
            own_blocks=own_blocks(options), progress=progress,
        )  # fmt: skip
    print("\n".join(sweep_lines(table, terminal_width(), quantiles)))
    print(f"table: {table_path}")
    if plot and table.quantities:
        print(f"plot: {plot}")
    if options.sensitivity is not None:
        print(f"sensitivity: {options.sensitivity}")
    return 0 if table.passed else FAILED


def tune(options: argparse.Namespace) -> int:
    """Look for the best values of parameters; 1 if the best trial fails."""
    from quadvis.sweeps.axes import read_seeds
    from quadvis.sweeps.tune import tune as search
    from quadvis.sweeps.tune_lines import TuneLine, parameter_file, tune_lines

    if options.output:
        check_output(options.output, PARAMETERS)
    seeds = read_seeds(options.seeds) if options.seeds else ()
    collected_from_now_on()
    with TuneLine() as progress:
        result = search(
            options.file, options.minimise, _ranges(options.over),
            variant=options.variant, settings=options.set, params=options.params,
            stop_time=options.stop_time, seeds=seeds, method=options.method,
            most=options.trials, passing=options.passing, own_blocks=own_blocks(options),
            engine=options.engine, announce=progress.say, progress=progress,
        )  # fmt: skip
    print("\n".join(tune_lines(result)))
    if options.output:
        write_output(options.output, PARAMETERS, parameter_file(result))
        print(f"parameters: {options.output}")
    else:
        print(" ".join(f"--set {shlex.quote(f'{name}={text}')}" for name, text in result.settings.items()))
    return 0 if result.best.passed else FAILED


def _ranges(texts: Sequence[str]) -> dict[str, str]:
    """Return the ranges that ``--over`` gives, by parameter."""
    return {name.strip(): span.strip() for name, _, span in (text.partition("=") for text in texts)}


def export(options: argparse.Namespace) -> int:
    """Write a part of a diagram as an FMU, or the signals of a log for other programs."""
    if options.fmu is None:
        return _export_log(options)
    from quadvis.export.fmu import export_fmu
    from quadvis.export.selection import WHOLE
    from quadvis.machine.status_line import StatusLine

    diagram = load_diagram(options)
    name = default_name(options, options.variant) if options.fmu == WHOLE else file_name(options.fmu)
    output = options.output or f"{name}.fmu"
    with StatusLine() as line:
        made = export_fmu(diagram, options.fmu, output, version=options.fmi, announce=line.say)
    for what, names in (("inputs", made.inputs), ("outputs", made.outputs), ("parameters", made.parameters)):
        print(f"{what + ':':12}{', '.join(names) or 'none'}")
    print(f"{output}: FMI {made.version}.0, steps of {made.step:.9g} s")
    return 0


def _export_log(options: argparse.Namespace) -> int:
    """Write signals of a log."""
    from quadvis.graph.names import split_names
    from quadvis.output.log_reader import read_log
    from quadvis.output.table_files import FORMATS, TableRequest, write_table

    if options.file.endswith(YAML):
        raise QuadvisError(f"'{options.file}' is no log of a run; add --fmu PART to pack a part of a diagram")
    if options.output is None:
        raise QuadvisError(f"say where to, by -o FILE with the suffix {', '.join(FORMATS)}")
    log = read_log(options.file)
    if log.damage:
        print(log.damage, file=sys.stderr)
    names = tuple(name for text in options.signals for name in split_names(text) if name)
    write_table(log, Path(options.output), TableRequest(names, options.rate or "", options.every or ""))
    return 0


def plot(options: argparse.Namespace) -> int:
    """Draw figures of logs."""
    from quadvis.cli.plot import plot as perform

    return perform(options, own_blocks(options))
