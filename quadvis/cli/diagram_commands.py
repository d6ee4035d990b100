"""The commands that look at diagrams without a run. Each returns the exit code."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.cli.default_places import default_name
from quadvis.cli.given import FAILED, load_diagram, own_blocks
from quadvis.cli.shown import plain_faults, print_json, print_warnings, write_text
from quadvis.errors import DiagramError, QuadvisError, quoted
from quadvis.machine.files import PDF, SVG, file_name, write_output
from quadvis.machine.garbage import collected_from_now_on

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.graph.graph import Graph
    from quadvis.run.accuracy import Accuracy

NO_VARIANT = "none"


def check(options: argparse.Namespace) -> int:
    """Report all faults of a diagram, 2 if any are found; with --accuracy 1 if its step is too large."""
    from quadvis.analysis.ages import worst_ages
    from quadvis.diagram.load import check as check_diagram

    try:
        diagram = (
            load_diagram(options)
            if options.variant
            else check_diagram(options.file, options.set, options.params, own_blocks(options))
        )
    except DiagramError as error:
        if not options.json:
            raise
        print_json({"ok": False, "faults": plain_faults(error.faults), "warnings": []})
        return error.exit_code
    print_warnings(diagram, options)
    tasks = ", ".join(task.name for task in diagram.graph.tasks)
    count = sum(not node.origin for node in diagram.graph.nodes)
    links = {link.name: link.facts() for link in diagram.links}
    ages = worst_ages(diagram)
    accuracy: Accuracy | None = None
    if options.json:
        found = {"ok": True, "diagram": diagram.name, "blocks": count, "hash": diagram.hash, "links": links}
        found |= {"ages": {age.text: age.greatest for age in ages}}
        found |= {"accuracy": (accuracy := _accuracy(diagram)).facts()} if options.accuracy else {}
        print_json(found | {"warnings": plain_faults(diagram.warnings)})
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
    own = own_blocks(options)
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


def program(options: argparse.Namespace) -> int:
    """Print the program of a diagram as a table."""
    from quadvis.engine.program import make_program
    from quadvis.run.listing import program_lines

    diagram = load_diagram(options)
    print("\n".join(program_lines(make_program(diagram.graph, diagram.seed))))
    return 0


def analyse(options: argparse.Namespace) -> int:
    """Print poles, margins, transfers and limits of a loop; 1 if it is not stable or misses a margin."""
    from quadvis.analysis.analyse import analyse as analyse_loop
    from quadvis.analysis.plots import save_plots
    from quadvis.analysis.progress import watched
    from quadvis.analysis.questions import read_cuts, read_limits, read_time
    from quadvis.analysis.report import analysis_lines
    from quadvis.machine.status_line import AnalysisLine

    diagram = load_diagram(options)
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
        print_json(facts | {"plots": paths})
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
        print_json(found.facts() | {"plot": options.plot})
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
        diagram = load_diagram(options)
    except DiagramError:
        return _draw_with_faults(options, output)
    picture = draw_diagram(diagram, part=options.part or "", depth=options.depth)
    return write_text(picture, output, SVG, diagram.inputs)


def _draw_book(options: argparse.Namespace) -> int:
    """Write the pictures of a diagram and of its parts as a PDF."""
    from quadvis.diagram.book import draw_book

    for given, name in ((options.part, "--part"), (options.depth, "--depth"), (options.output, "--output")):
        if given is not None:
            raise QuadvisError(f"--book draws the whole and each part; leave out {name}")
    diagram = load_diagram(options)
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
    write_text(picture, output, SVG, [Path(options.file)])
    raise error


def diff(options: argparse.Namespace) -> int:
    """Print the difference of two diagrams or runs; 1 if there is one."""
    if options.git:
        return _flat(options)
    from quadvis.diff.difference import diff as compare
    from quadvis.diff.report import DiffReport
    from quadvis.machine.status_line import shows_colours

    first, second = (None if name == NO_VARIANT else name for name in options.variants or [NO_VARIANT] * 2)
    found = compare(options.old, options.new, variants=(first, second), own_blocks=own_blocks(options))
    if options.json:
        print_json(found.as_data())
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
