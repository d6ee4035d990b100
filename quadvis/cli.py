"""The command line. Each command imports what it needs, so that `--help` and `check` stay quick."""

from __future__ import annotations

import argparse
import gc
import os
import re
import signal
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from quadvis.errors import QuadvisError, RunError

FAILED, INTERRUPTED, PIPE_BROKEN = 1, 130, 141

JSON_HELP = """\
--json prints one object: diagram, variant, params, hash, seed, passed, duration_s, wall_s, cpu_s,
real_time_factor, log;
summary: {label: {signal, unit, and the statistics by name}};
expect: [{expectation, signal, kind, unit, limit, found, met}].
Numbers are in the unit beside them, null where there is none.
Exit code: 0 all expectations met, 1 one is not or the run stopped, 2 bad input, 130 interrupted."""

SWEEP_HELP = """\
With several --over all combinations are run, the last one changing fastest. A name is that of a parameter as
for --set, or seed, variant, params (files); 'none' stands for no variant and no file. A range is 0..29, or
with a step 1..3 step 0.5 rad/s. The table has the axes, the numbers of summary and expectations with their
units, passed, failure (why a run stopped) and the hash of the diagram; it does not depend on the number of
processes. Wall times do, so they stand in it only with --timings.
Exit code: 0 all runs passed, 1 one did not, 2 bad input, 130 interrupted (what is done is in the table)."""

ANALYSE_HELP = """\
Noise is taken away, Newton's method finds the steady state near, and the loop is linearised there;
a sampled one is lifted over one hyperperiod. All signals of a cut are opened at once.
--json prints one object: diagram, variant, hash, hyperperiod_s (0 if all is continuous), states, stable;
poles: [[real, imaginary]] in 1/s; cuts: {name: {signals, gain_up, gain_down, phase_lag, phase_lead,
delay, crossover}} in factors, rad, s and rad/s, null where nothing limits;
limits: {name: {vary, unit, stable_to, reached, reason}}.
Exit code: 0 stable, 1 not stable, 2 bad input, or a loop that cannot be linearised."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0 ok, 1 a run failed or missed what it should, 2 bad input."""
    options = _parser().parse_args(arguments)
    with suppress(ValueError):  # signals belong to the main thread
        signal.signal(signal.SIGTERM, _terminate)
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a name may hold what the terminal cannot show
    try:
        code = int(options.command(options))
        sys.stdout.flush()
        return code
    except QuadvisError as error:
        print(error, *getattr(error, "__notes__", ()), sep="\n", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt as error:
        print("interrupted", *getattr(error, "__notes__", ()), sep="\n", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of the pipe has gone; Python would complain about what is still to be written.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_BROKEN


def _terminate(number: int, _: object) -> None:
    """Leave through the same door as an error does, so that every block is closed."""
    raise SystemExit(128 + number)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="quadvis", description="Block diagrams in YAML that fly a four-rotor craft."
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name: str, command: Any, words: str, epilog: str = "") -> argparse.ArgumentParser:
        added: argparse.ArgumentParser = commands.add_parser(
            name, help=words, description=f"{words[:1].upper()}{words[1:]}.", epilog=epilog,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )  # fmt: skip
        added.set_defaults(command=command)
        return added

    run = add("run", _run, "run a diagram and judge it by what it expects", JSON_HELP)
    _diagram_options(run)
    run.add_argument("--stop-time", metavar="T", help="such as '20 s'; replaces the diagram's")
    run.add_argument("--seed", type=int, metavar="N", help="seed of all noise; replaces the diagram's")
    run.add_argument(
        "--log", metavar="PATH", help="where to write the log; default runs/NAME.mcap, '' for none"
    )
    run.add_argument("--json", action="store_true", help="print one JSON object instead of the summary")
    _sweep_options(add("sweep", _sweep, "run a diagram at every point of a grid", SWEEP_HELP))
    check = add("check", _check, "check a diagram and tell all its faults")
    _diagram_options(check)
    check.add_argument("--json", action="store_true", help="print the faults as JSON")
    blocks = add("list", _list, "list all blocks")
    blocks.add_argument("--json", action="store_true", help="print all declarations as JSON")
    describe = add("describe", _describe, "describe a block: ports, parameters, source")
    describe.add_argument("block", metavar="BLOCK", help="such as signal.derivative")
    describe.add_argument("--json", action="store_true", help="print its declarations as JSON")
    analyse = add("analyse", _analyse, "linearise the closed loop: poles, margins, limits", ANALYSE_HELP)
    _diagram_options(analyse)
    words = "a cut point more: one signal or several, such as torque=control/roll.torque; repeat it for more"
    analyse.add_argument("--cut", action="append", default=[], metavar="[NAME=]SIGNAL,...", help=words)
    words = "how far a parameter can go, such as eyes/camera.latency='100 ms..2 s'; repeat it for more"
    analyse.add_argument("--vary", action="append", default=[], metavar="PARAM=FROM..TO", help=words)
    analyse.add_argument("--at", metavar="T", help="run so long before the operating point is sought")
    analyse.add_argument("--json", action="store_true", help="print one JSON object instead of the tables")
    analyse.add_argument("--output", "-o", metavar="FOLDER", help="write Bode plots there, as PNG")
    draw = add("draw", _draw, "draw a diagram as SVG")
    _diagram_options(draw)
    draw.add_argument("--output", "-o", metavar="PATH", help="default NAME.svg; '-' for standard output")
    plot = add("plot", _plot, "draw the figures that a log's diagram declares, as PNG")
    plot.add_argument("log", metavar="LOG")
    plot.add_argument("--output", "-o", metavar="FOLDER", help="default: beside the log")
    schema = add("schema", _schema, "print the JSON schema of diagrams, for editors")
    schema.add_argument("--output", "-o", metavar="PATH", help="default: standard output")
    new = add("new", _new, "write the skeleton of a block or of a diagram")
    new.add_argument("kind", choices=("block", "diagram"))
    new.add_argument("name", metavar="NAME", help="a block as group.block, a diagram as FILE.yaml")
    return parser


def _diagram_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the diagram")
    parser.add_argument("--variant", metavar="V", help="one of the diagram's variants")
    _setting_options(parser)


def _setting_options(parser: argparse.ArgumentParser) -> None:
    words = "file of such settings, which apply before --set; repeat it for more, applied in their order"
    parser.add_argument("--params", action="append", default=[], metavar="FILE", help=words)
    words = "replace a parameter, such as control/roll.bandwidth='2 rad/s'; repeat it for more"
    parser.add_argument("--set", action="append", default=[], metavar="BLOCK.PARAM=VALUE", help=words)


def _sweep_options(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("file", metavar="FILE", help="the diagram")
    words = (
        "seed=0..29, craft.lag='20 ms,50 ms', bandwidth='1..3 step 0.5 rad/s', variant=A,B; repeat for more"
    )
    parser.add_argument("--over", action="append", default=[], metavar="NAME=VALUES", help=words)
    words = "one of the diagram's variants; several are swept over"
    parser.add_argument("--variant", action="append", default=[], metavar="V", help=words)
    _setting_options(parser)
    parser.add_argument("--stop-time", metavar="T", help="such as '20 s'; replaces the diagram's")
    parser.add_argument("--seed", type=int, metavar="N", help="seed of every run; replaces the diagram's")
    parser.add_argument("--workers", type=int, metavar="N", help="processes; default: one per processor")
    words = "the table, .csv or .parquet; default runs/NAME-sweep.csv"
    parser.add_argument("--output", "-o", metavar="TABLE", help=words)
    words = "picture of the summary; default: beside the table, '' for none"
    parser.add_argument("--plot", metavar="PNG", help=words)
    parser.add_argument("--logs", metavar="FOLDER", help="write a log of every run; default: none")
    parser.add_argument("--resume", action="store_true", help="keep the runs that the table has already")
    parser.add_argument("--timings", action="store_true", help="add the wall time of each run to the table")


def _load(options: argparse.Namespace, **more: Any) -> Any:
    from quadvis.diagram.diagram import load

    given = {"variant": options.variant, "settings": options.set, "params": options.params}
    return load(options.file, **given, **more)


def _run(options: argparse.Namespace) -> int:
    from quadvis.report import ProgressLine, summary_lines
    from quadvis.run import run

    diagram = _load(options, stop_time=options.stop_time, seed=options.seed)
    log = _log_path(options.log, diagram)
    gc.enable()
    try:
        with ProgressLine(diagram.duration) as progress:
            result = run(diagram, log=log, progress=progress)
    except (RunError, KeyboardInterrupt):
        if log is not None and log.is_file():
            print(f"log up to there: {log}", file=sys.stderr)
        raise
    if options.json:
        _print_json(result.facts() | {"log": str(log) if log else None})
    else:
        print("\n".join(summary_lines(result)))
        if log:
            print(f"log: {log}")
    return 0 if result.passed else FAILED


def _sweep(options: argparse.Namespace) -> int:
    from quadvis.sweeps.summary import SweepLine, sweep_lines
    from quadvis.sweeps.sweep import sweep

    several = len(options.variant) > 1
    over = [f"variant={','.join(options.variant)}"] * several + options.over
    table_path = Path(options.output or _runs_folder("table", "-o") / f"{Path(options.file).stem}-sweep.csv")
    plot = table_path.parent / f"{table_path.stem}.png" if options.plot is None else Path(options.plot)
    if options.plot and (plot.suffix != ".png" or not plot.parent.is_dir()):
        raise QuadvisError(
            f"cannot write the plot '{plot}': give a name that ends in .png in a folder there is"
        )
    gc.enable()
    with SweepLine() as progress:
        table = sweep(
            options.file, over, variant=None if several else next(iter(options.variant), None),
            settings=options.set, params=options.params, stop_time=options.stop_time, seed=options.seed,
            workers=options.workers, output=table_path, timings=options.timings, resume=options.resume,
            logs=options.logs, progress=progress,
        )  # fmt: skip
    print("\n".join(sweep_lines(table, _width())))
    print(f"table: {table_path}")
    if options.plot != "":
        table.plot(plot)
        print(f"plot: {plot}")
    return 0 if table.passed else FAILED


def _log_path(given: str | None, diagram: Any) -> Path | None:
    """Return where the log goes: where it is wanted, or in a folder that is made for it."""
    if given is not None:
        path = Path(given)
        if given and path.is_dir():
            raise QuadvisError(f"cannot write the log '{given}': it is a folder")
        if given and not path.parent.is_dir():
            raise QuadvisError(f"cannot write the log '{given}': there is no folder '{path.parent}'")
        return path if given else None
    sets = (file.name for file in diagram.parameter_files)
    name = "-".join(filter(None, (diagram.name, diagram.variant, *sets)))
    file = f"{re.sub(r'[^A-Za-z0-9_.-]+', '-', name).strip('-.') or 'run'}.mcap"
    return _runs_folder("log", "--log") / file


def _runs_folder(what: str, option: str) -> Path:
    """Return the folder for what a command leaves behind unless an option names another place."""
    path = Path("runs")
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        problem = f"cannot make the folder '{path}' for the {what}: {(error.strerror or str(error)).lower()}"
        raise QuadvisError(f"{problem}; name another place with {option}") from error
    return path


def _check(options: argparse.Namespace) -> int:
    from quadvis.diagram.diagram import check
    from quadvis.errors import DiagramError

    try:
        diagram = _load(options) if options.variant else check(options.file, options.set, options.params)
    except DiagramError as error:
        if not options.json:
            raise
        faults = [
            {"file": fault.place.file, "line": fault.place.line, "column": fault.place.column,
             "subject": fault.subject, "problem": fault.problem, "remedy": fault.remedy}
            for fault in error.faults
        ]  # fmt: skip
        _print_json({"ok": False, "faults": faults})
        return error.exit_code
    tasks = ", ".join(task.name for task in diagram.graph.tasks)
    count = len(diagram.graph.nodes)
    if options.json:
        _print_json({"ok": True, "diagram": diagram.name, "blocks": count, "hash": diagram.hash})
    else:
        print(f"{options.file}: {count} blocks in {tasks}: no fault")
    return 0


def _list(options: argparse.Namespace) -> int:
    from quadvis.catalogue import Catalogue
    from quadvis.describe import catalogue_lines, facts

    catalogue = Catalogue(Path())
    if options.json:
        _print_json([facts(name, catalogue.find(name)) for name in catalogue.names()])
        return 0
    lines, failures = catalogue_lines(catalogue, _width())
    print("\n".join(lines))
    if failures:
        raise QuadvisError("\n".join(failures))
    return 0


def _describe(options: argparse.Namespace) -> int:
    from quadvis.catalogue import Catalogue
    from quadvis.describe import description, facts

    block = Catalogue(Path()).find(options.block)
    if options.json:
        _print_json(facts(options.block, block))
    else:
        print(description(options.block, block, _width()))
    return 0


def _analyse(options: argparse.Namespace) -> int:
    from quadvis.analysis.questions import read_cuts, read_limits, read_time
    from quadvis.analysis.report import analysis_lines, save_bode_plots

    diagram = _load(options)
    cuts, limits, at = read_cuts(options.cut), read_limits(options.vary), read_time(options.at)
    analysis = diagram.analyse(cuts=cuts, limits=limits, at=at)
    if not options.json:
        for line in analysis_lines(analysis):
            print(line, flush=True)
    paths = [str(path) for path in save_bode_plots(analysis, Path(options.output))] if options.output else []
    if options.json:
        _print_json(analysis.facts() | {"plots": paths})
    elif paths:
        print("\n".join(paths))
    return 0 if analysis.stable else FAILED


def _draw(options: argparse.Namespace) -> int:
    diagram = _load(options)
    text = diagram.draw()
    return _write(text, options.output or f"{Path(options.file).stem}.svg")


def _plot(options: argparse.Namespace) -> int:
    from quadvis.output.log import read_log
    from quadvis.output.plot import plot_log

    for path in plot_log(read_log(options.log), Path(options.output) if options.output else None):
        print(path)
    return 0


def _schema(options: argparse.Namespace) -> int:
    from quadvis.catalogue import Catalogue
    from quadvis.diagram.schema import diagram_schema

    return _write(_json(diagram_schema(Catalogue(Path())), indent=1) + "\n", options.output or "-")


def _new(options: argparse.Namespace) -> int:
    from quadvis.skeleton import new_block, new_diagram

    for path in (new_block if options.kind == "block" else new_diagram)(options.name):
        print(path)
    return 0


def _print_json(data: Any) -> None:
    print(_json(data))


def _json(data: Any, indent: int | None = None) -> str:
    import json

    return json.dumps(data, indent=indent, allow_nan=False)


def _width() -> int | None:
    """Return the width of the terminal; None where text goes elsewhere."""
    from shutil import get_terminal_size

    return get_terminal_size().columns if sys.stdout.isatty() else None


def _write(text: str, output: str) -> int:
    if output == "-":
        sys.stdout.write(text)
        return 0
    try:
        Path(output).write_text(text, encoding="utf-8")
    except OSError as error:
        raise QuadvisError(f"cannot write '{output}': {error.strerror}") from error
    print(output)
    return 0
