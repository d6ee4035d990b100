"""The commands. Each takes its options as they were typed and returns the exit code.

The file is long because it has all commands, each of a few lines.
"""

from __future__ import annotations

import argparse
import shlex
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.cli.default_places import default_name, log_path, runs_folder
from quadvis.errors import DiagramError, Fault, QuadvisError, RunError, counted, quoted
from quadvis.machine.files import PDF, SVG, Kind, check_output, file_name, write_output
from quadvis.machine.garbage import collected_from_now_on
from quadvis.machine.shipped import PREFIX, named_file

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.graph.graph import Graph
    from quadvis.library.catalogue import Catalogue, OwnBlocks
    from quadvis.realtime.options import RealTime
    from quadvis.run.accuracy import Accuracy

SCHEMA = Kind("the schema", (b"{",), rb'"\$schema"')
PARAMETERS = Kind("the parameter file", (b"#", b"quadvis:"), rb"^set:")
FAILED = 1
NO_VARIANT = "none"
YAML = (".yaml", ".yml")


def _load(options: argparse.Namespace, **more: Any) -> Any:
    from quadvis.diagram.load import load

    given = {"variant": options.variant, "settings": options.set, "params": options.params}
    return load(options.file, **given, **more, own_blocks=_own_blocks(options))


def _own_blocks(options: argparse.Namespace) -> OwnBlocks:
    """Return the treatment of the blocks beside a diagram: refuse them, or announce them once."""
    if options.no_own_blocks:
        return False
    said = set()

    def say(folder: Path) -> None:
        if folder not in said:
            what = "own blocks" if folder.is_dir() else "machine code"
            print(f"{what} from {str(folder)!r}", file=sys.stderr, flush=True)
        said.add(folder)

    return say


def run(options: argparse.Namespace) -> int:
    """Run a diagram and print the summary; 1 if the run misses an expectation."""
    from quadvis.machine.status_line import ProgressLine
    from quadvis.run.report import summary_lines
    from quadvis.run.session import run as run_diagram

    if options.target is not None or options.on:
        from quadvis.cli.run_on_target import check_options, run_on_several, run_on_target

        check_options(options)
    real_time = _real_time(options)
    diagram = _load(options, stop_time=options.stop_time, seed=options.seed)
    log = log_path(options.log, diagram)
    _print_warnings(diagram, options)
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
        _print_json(result.facts() | outputs | {"warnings": _plain_faults(diagram.warnings)})
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
            progress=progress, announce=progress.say, own_blocks=_own_blocks(options),
        )  # fmt: skip
    if options.json:
        _print_json(replay_facts(found))
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
    from quadvis.sweeps.sweep import sweep as run_sweep

    several = len(options.variant) > 1
    over = [f"variant={','.join(options.variant)}"] * several + options.over
    one = None if several else next(iter(options.variant), None)
    name = f"{default_name(options, one)}-sweep.csv"
    table_path = Path(options.output or runs_folder("table", "-o") / name)
    quantiles = read_quantiles(options.quantiles) if options.quantiles is not None else None
    plot = table_path.parent / f"{table_path.stem}.png" if options.plot is None else Path(options.plot)
    if options.plot and plot.suffix != ".png":
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
            plot=None if options.plot == "" else plot, sensitivity=options.sensitivity, logs=options.logs,
            own_blocks=_own_blocks(options), progress=progress,
        )  # fmt: skip
    print("\n".join(sweep_lines(table, _width(), quantiles)))
    print(f"table: {table_path}")
    if options.plot != "":
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
            most=options.trials, passing=options.passing, own_blocks=_own_blocks(options),
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


def _hold_ups(graph: Graph) -> list[str]:
    """Return which tasks can hold each other up in real time, if each runs by itself."""
    from quadvis.graph.graph import MULTI
    from quadvis.realtime.hold_ups import hold_ups

    if graph.tasking != MULTI:
        return []
    python = {node.path for node in graph.nodes if not node.block.numeric}
    return [line for name in graph.computers for line in hold_ups(graph.part_of(name), python)]


def _places(diagram: Diagram, options: argparse.Namespace) -> list[str]:
    """Return what the variants of a diagram with computers share."""
    from quadvis.diff.places import shared_blocks
    from quadvis.diff.sides import read_side

    if options.variant or diagram.graph.computers == ("",) or len(diagram.variants) < 2:
        return []
    own = _own_blocks(options)
    return [
        str(shared_blocks({name: read_side(options.file, name, own).sections for name in diagram.variants}))
    ]


def _accuracy(diagram: Diagram) -> Accuracy:
    """Run a diagram with smaller steps."""
    from quadvis.machine.status_line import AnalysisLine
    from quadvis.run.accuracy import accuracy

    collected_from_now_on()
    with AnalysisLine() as progress:
        return accuracy(diagram, progress)


def check(options: argparse.Namespace) -> int:
    """Report all faults of a diagram, 2 if any are found; with --accuracy 1 if its step is too large."""
    from quadvis.analysis.ages import worst_ages
    from quadvis.diagram.load import check as check_diagram
    from quadvis.errors import DiagramError

    try:
        diagram = (
            _load(options)
            if options.variant
            else check_diagram(options.file, options.set, options.params, _own_blocks(options))
        )
    except DiagramError as error:
        if not options.json:
            raise
        _print_json({"ok": False, "faults": _plain_faults(error.faults), "warnings": []})
        return error.exit_code
    _print_warnings(diagram, options)
    tasks = ", ".join(task.name for task in diagram.graph.tasks)
    count = sum(not node.origin for node in diagram.graph.nodes)
    links = {link.name: link.facts() for link in diagram.links}
    ages = worst_ages(diagram)
    accuracy: Accuracy | None = None
    if options.json:
        found = {"ok": True, "diagram": diagram.name, "blocks": count, "hash": diagram.hash, "links": links}
        found |= {"ages": {age.text: age.greatest for age in ages}}
        found |= {"accuracy": (accuracy := _accuracy(diagram)).facts()} if options.accuracy else {}
        _print_json(found | {"warnings": _plain_faults(diagram.warnings)})
    else:
        print(f"{options.file}: {count} blocks in {tasks}: no fault")
        lines = [*(f"link {name}: {facts}" for name, facts in links.items()), *map(str, ages)]
        lines += _hold_ups(diagram.graph)
        lines += _places(diagram, options)
        print("".join(f"  {line}\n" for line in lines), end="", flush=True)
        if options.accuracy:
            from quadvis.run.report import accuracy_lines

            accuracy = _accuracy(diagram)
            print("\n".join(accuracy_lines(accuracy)))
    return 0 if accuracy is None or accuracy.converged else FAILED


def _print_warnings(diagram: Any, options: argparse.Namespace) -> None:
    if not options.json:
        for warning in diagram.warnings:
            print(warning, file=sys.stderr)


def _plain_faults(faults: Iterable[Fault]) -> list[dict[str, Any]]:
    """Return faults or warnings as plain data."""
    return [
        {"file": fault.place.file, "line": fault.place.line, "column": fault.place.column,
         "subject": fault.subject, "problem": fault.problem, "remedy": fault.remedy}
        for fault in faults
    ]  # fmt: skip


def camera(options: argparse.Namespace) -> int:
    """List the cameras, show what one sees, or calibrate it."""
    from quadvis.cli.camera import camera as perform

    return perform(options)


def list_blocks(options: argparse.Namespace) -> int:
    """Print all blocks and files that come with quadvis, or those with words; 2 if one cannot be loaded."""
    from quadvis.library.listing import lines, listed_blocks, listed_files, matching

    catalogue = _catalogue(options)
    blocks, failures = listed_blocks(catalogue)
    files = listed_files()
    if options.words:
        found = matching([*blocks, *files], options.words)
        blocks, files = [each for each in found if each in blocks], [each for each in found if each in files]
    if options.json:
        from quadvis.library.describe import facts

        _print_json([facts(each.name, catalogue.find(each.name)) for each in blocks])
    else:
        parts = [lines(each, _width()) for each in (blocks, files) if each]
        print("\n\n".join("\n".join(part) for part in parts))
    return _all_loaded(failures)


def _catalogue(options: argparse.Namespace) -> Catalogue:
    """Return the catalogue for diagrams in the working directory."""
    from quadvis.library.catalogue import Catalogue

    return Catalogue(Path(), _own_blocks(options))


def _all_loaded(failures: list[str]) -> int:
    """Report at the end which blocks could not be loaded."""
    if failures:
        raise QuadvisError("\n".join(failures))
    return 0


def describe(options: argparse.Namespace) -> int:
    """Print the declarations of a block, those of a part, or a file that comes with quadvis."""
    from quadvis.library.describe import description, facts
    from quadvis.library.shipped_files import shipped_text

    if options.block.startswith(PREFIX):
        text = shipped_text(options.block)
        if options.json:
            _print_json({"file": options.block, "path": str(named_file(options.block)), "text": text})
        else:
            print(text, end="")
        return 0
    if options.block.endswith(YAML):
        from quadvis.diagram.part_description import part_description, part_facts

        if options.json:
            _print_json(part_facts(options.block))
        else:
            print(part_description(options.block, _width()))
        return 0
    block = _catalogue(options).find(options.block)
    if options.json:
        _print_json(facts(options.block, block))
    else:
        print(description(options.block, block, _width()))
    return 0


def diff(options: argparse.Namespace) -> int:
    """Print the difference of two diagrams or runs; 1 if there is one."""
    if options.git:
        return _flat(options)
    from quadvis.diff.difference import diff as compare
    from quadvis.diff.report import DiffReport
    from quadvis.machine.status_line import shows_colours

    first, second = (None if name == NO_VARIANT else name for name in options.variants or [NO_VARIANT] * 2)
    found = compare(options.old, options.new, variants=(first, second), own_blocks=_own_blocks(options))
    if options.json:
        _print_json(found.as_data())
    else:
        print("\n".join(DiffReport(found, shows_colours(sys.stdout)).lines()))
    return 0 if found.same else FAILED


def _flat(options: argparse.Namespace) -> int:
    """Print one file with a line for each value, for git to compare."""
    from quadvis.diff.flat import flat_text
    from quadvis.machine.inputs import read_input

    if options.new is not None or options.variants:
        raise QuadvisError(f"--git takes one file; leave {quoted(options.new or '--variants')} out")
    print(flat_text(read_input(options.old).decode(errors="replace")), end="")
    return 0


def merge(options: argparse.Namespace) -> int:
    """Merge three versions of a file by key; 1 with conflicts."""
    from quadvis.cli.merge import merge as perform

    return perform(options)


def fmt(options: argparse.Namespace) -> int:
    """Write files in the house style; 1 with --check if one is not."""
    from quadvis.cli.fmt import fmt as perform

    return perform(options)


def analyse(options: argparse.Namespace) -> int:
    """Print poles, margins, transfers and limits of a loop; 1 if it is not stable or misses a margin."""
    from quadvis.analysis.analyse import analyse as analyse_loop
    from quadvis.analysis.plots import save_plots
    from quadvis.analysis.progress import watched
    from quadvis.analysis.questions import read_cuts, read_limits, read_time
    from quadvis.analysis.report import analysis_lines
    from quadvis.machine.status_line import AnalysisLine

    diagram = _load(options)
    cuts, limits, at = read_cuts(options.cut), read_limits(options.vary), read_time(options.at)
    transfers = read_cuts(options.transfer)
    with AnalysisLine() as progress, watched(progress):
        analysis = analyse_loop(diagram, cuts, limits, at, options.engine, transfers)
        if options.json:
            facts = analysis.facts()
        else:
            for line in analysis_lines(analysis):
                progress.clear()
                print(line, flush=True)
    paths: list[str] = []
    if options.output:
        paths = [str(path) for path in save_plots(analysis, Path(options.output))]
    if options.json:
        _print_json(facts | {"plots": paths})
    elif paths:
        print("\n".join(paths))
    return 0 if analysis.passed else FAILED


def identify(options: argparse.Namespace) -> int:
    """Find a transfer function from a recording, and print it with the block that it makes."""
    from quadvis.analysis.identify import VALIDATION
    from quadvis.analysis.identify import identify as find
    from quadvis.analysis.plots import save_fit
    from quadvis.analysis.progress import watched
    from quadvis.analysis.questions import read_time
    from quadvis.machine.status_line import AnalysisLine

    with AnalysisLine() as progress, watched(progress):
        found = find(
            options.log, input=options.input, output=options.output, order=options.order,
            zeros=options.zeros, delay=options.delay, discrete=options.discrete,
            after=read_time(options.after) or 0.0,
            validation=VALIDATION if options.validation is None else options.validation,
        )  # fmt: skip
    if options.plot:
        save_fit(found, Path(options.plot), [Path(options.log)])
    if options.json:
        _print_json(found.facts() | {"plot": options.plot})
        return 0
    print("\n".join(found.lines()))
    print(f"blocks:\n{found.block()}")
    if options.plot:
        print(f"plot: {options.plot}")
    return 0


def draw(options: argparse.Namespace) -> int:
    """Write a diagram as SVG, or as a book; one with faults, too, which are then reported."""
    from quadvis.diagram.picture import draw_diagram

    if options.book is not None:
        return _draw_book(options)
    if options.paper is not None:
        raise QuadvisError("--paper is for a book; add --book FILE.pdf")
    name = default_name(options, options.variant) + (f"-{file_name(options.part)}" if options.part else "")
    output = options.output or f"{name}.svg"
    try:
        diagram = _load(options)
    except DiagramError:
        return _draw_with_faults(options, output)
    picture = draw_diagram(diagram, part=options.part or "", depth=options.depth)
    return _write(picture, output, SVG, diagram.inputs)


def _draw_book(options: argparse.Namespace) -> int:
    """Write the pictures of a diagram and of its parts as a PDF."""
    from quadvis.diagram.book import draw_book

    for given, name in ((options.part, "--part"), (options.depth, "--depth"), (options.output, "--output")):
        if given is not None:
            raise QuadvisError(f"--book draws the whole and each part; leave out {name}")
    diagram = _load(options)
    write_output(options.book, PDF, draw_book(diagram, options.paper or ""), diagram.inputs)
    print(options.book)
    return 0


def _draw_with_faults(options: argparse.Namespace, output: str) -> int:
    """Write the picture of a diagram with faults, then raise them."""
    from quadvis.diagram.load import draw_with_faults

    picture, error = draw_with_faults(
        options.file, variant=options.variant, settings=options.set, params=options.params,
        own_blocks=not options.no_own_blocks, part=options.part or "", depth=options.depth,
    )  # fmt: skip
    _write(picture, output, SVG, [Path(options.file)])
    raise error


def export(options: argparse.Namespace) -> int:
    """Write a part of a diagram as an FMU, or the signals of a log for other programs."""
    if options.fmu is None:
        return _export_log(options)
    from quadvis.export.fmu import export_fmu
    from quadvis.export.selection import WHOLE
    from quadvis.machine.status_line import StatusLine

    diagram = _load(options)
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


def program(options: argparse.Namespace) -> int:
    """Print the program of a diagram as a table."""
    from quadvis.engine.program import make_program
    from quadvis.run.listing import program_lines

    diagram = _load(options)
    print("\n".join(program_lines(make_program(diagram.graph, diagram.seed))))
    return 0


def plot(options: argparse.Namespace) -> int:
    """Draw figures of logs."""
    from quadvis.cli.plot import plot as perform

    return perform(options, _own_blocks(options))


def schema(options: argparse.Namespace) -> int:
    """Write the JSON schema of diagrams; 2 if a block cannot be loaded, which is then left out."""
    from quadvis.diagram.schema import diagram_schema

    blocks, failures = _catalogue(options).load_all()
    _write(_json(diagram_schema(blocks), indent=1) + "\n", options.output or "-", SCHEMA)
    return _all_loaded(failures)


def completion(options: argparse.Namespace) -> int:
    """Print the script with which a shell completes words."""
    from quadvis.cli.completion import completion as script
    from quadvis.cli.options import parser

    print(script(parser(), options.shell), end="")
    return 0


def cache(options: argparse.Namespace) -> int:
    """Print where machine code is kept, and how much; remove it if asked for."""
    from quadvis.native import cache as kept

    files = list(kept.files())
    size = sum(size for _, size in files)
    what = f"{counted(len(files), 'block type')}, {size / 1e6:.1f} MB"
    if options.clear:
        kept.clear()
        print(f"removed from {kept.folder()}: {what}")
    else:
        print(f"{kept.folder()}: {what}")
    return 0


def new(options: argparse.Namespace) -> int:
    """Write the skeleton of a block, an output device, a diagram or a project."""
    from quadvis.library.skeleton import KINDS, new_block, new_diagram, new_project

    name, kind = options.name, options.kind
    made = {"diagram": new_diagram, "project": new_project}
    for path in new_block(name, kind) if kind in KINDS else made[kind](name):
        print(path)
    return 0


def _print_json(data: Any) -> None:
    print(_json(data))


def _json(data: Any, indent: int | None = None) -> str:
    import json

    return json.dumps(data, indent=indent, allow_nan=False)


def _width() -> int | None:
    """Return the width of the terminal; None if the text goes elsewhere."""
    from shutil import get_terminal_size

    return get_terminal_size().columns if sys.stdout.isatty() else None


def _write(text: str, output: str, kind: Kind, inputs: Sequence[Path] = ()) -> int:
    if output == "-":
        sys.stdout.write(text)
        return 0
    write_output(output, kind, text, inputs)
    print(output)
    return 0
