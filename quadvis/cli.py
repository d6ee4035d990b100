"""The command line. Each command imports what it needs, so that `--help` and `check` stay quick."""

from __future__ import annotations

import argparse
import json
import signal
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from quadvis.errors import QuadvisError

FAILED, INTERRUPTED = 1, 130


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code: 0 ok, 1 a run failed or missed what it should, 2 bad input."""
    options = _parser().parse_args(arguments)
    signal.signal(signal.SIGTERM, _terminate)
    try:
        return int(options.command(options))
    except QuadvisError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt:
        print("interrupted", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of the pipe has gone; there is nobody left to tell.
        sys.stderr.close()
        return 0


def _terminate(number: int, _: object) -> None:
    """Leave through the same door as an error does, so that every block is closed."""
    raise SystemExit(128 + number)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="quadvis", description="Block diagrams in YAML that fly a four-rotor craft.")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def add(name: str, command: Any, words: str) -> argparse.ArgumentParser:
        added: argparse.ArgumentParser = commands.add_parser(name, help=words, description=words)
        added.set_defaults(command=command)
        return added

    run = add("run", _run, "run a diagram and judge it by what it expects")
    _diagram_options(run)
    run.add_argument("--stop-time", metavar="T", help="such as '20 s'; replaces the diagram's")
    run.add_argument("--seed", type=int, metavar="N", help="seed of all noise; replaces the diagram's")
    run.add_argument("--log", metavar="PATH", help="where to write the log; default runs/NAME.mcap, '' for none")
    run.add_argument("--json", action="store_true", help="print one JSON object instead of the summary")
    check = add("check", _check, "check a diagram and tell all its faults")
    _diagram_options(check)
    check.add_argument("--json", action="store_true", help="print the faults as JSON")
    blocks = add("list", _list, "list all blocks")
    blocks.add_argument("--json", action="store_true", help="print all declarations as JSON")
    describe = add("describe", _describe, "describe a block: ports, parameters, source")
    describe.add_argument("block", metavar="BLOCK", help="such as signal.derivative")
    describe.add_argument("--json", action="store_true", help="print its declarations as JSON")
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
    parser.add_argument("--set", action="append", default=[], metavar="BLOCK.PARAM=VALUE",
                        help="replace a parameter, such as roll.bandwidth='2.5 rad/s'; repeat for more")  # fmt: skip


def _load(options: argparse.Namespace, **more: Any) -> Any:
    from quadvis.diagram import load

    return load(options.file, variant=options.variant, settings=options.set, **more)


def _run(options: argparse.Namespace) -> int:
    from quadvis.report import ProgressLine, summary_lines
    from quadvis.run import run

    diagram = _load(options, stop_time=options.stop_time, seed=options.seed)
    log = options.log
    if log is None:
        log = Path("runs") / f"{diagram.name}{f'-{diagram.variant}' if diagram.variant else ''}.mcap"
        log.parent.mkdir(exist_ok=True)
    with ProgressLine(diagram.duration) as progress:
        result = run(diagram, log=log or None, progress=progress)
    if options.json:
        print(json.dumps(result.facts() | {"log": str(log) or None}, allow_nan=False))
    else:
        print("\n".join(summary_lines(result)))
        if log:
            print(f"log: {log}")
    return 0 if result.passed else FAILED


def _check(options: argparse.Namespace) -> int:
    from quadvis.errors import DiagramError

    try:
        diagram = _load(options)
    except DiagramError as error:
        if not options.json:
            raise
        faults = [
            {"file": fault.place.file, "line": fault.place.line, "column": fault.place.column,
             "subject": fault.subject, "problem": fault.problem, "remedy": fault.remedy}
            for fault in error.faults
        ]  # fmt: skip
        print(json.dumps({"ok": False, "faults": faults}))
        return error.exit_code
    tasks = ", ".join(task.name for task in diagram.graph.tasks)
    facts = {"ok": True, "diagram": diagram.name, "blocks": len(diagram.graph.nodes), "hash": diagram.hash}
    print(json.dumps(facts) if options.json else
          f"{options.file}: {len(diagram.graph.nodes)} blocks in {tasks}: no fault")  # fmt: skip
    return 0


def _list(options: argparse.Namespace) -> int:
    from quadvis.catalogue import Catalogue
    from quadvis.describe import catalogue_lines, facts

    catalogue = Catalogue(Path())
    if options.json:
        print(json.dumps([facts(name, catalogue.find(name)) for name in catalogue.names()]))
        return 0
    lines, failures = catalogue_lines(catalogue)
    print("\n".join(lines))
    if failures:
        raise QuadvisError("\n".join(failures))
    return 0


def _describe(options: argparse.Namespace) -> int:
    from quadvis.catalogue import Catalogue
    from quadvis.describe import description, facts

    block = Catalogue(Path()).find(options.block)
    print(json.dumps(facts(options.block, block)) if options.json else description(options.block, block))
    return 0


def _draw(options: argparse.Namespace) -> int:
    diagram = _load(options)
    text = diagram.draw()
    return _write(text, options.output or f"{Path(options.file).stem}.svg")


def _plot(options: argparse.Namespace) -> int:
    from quadvis.log import read_log
    from quadvis.plot import plot_log

    for path in plot_log(read_log(options.log), Path(options.output) if options.output else None):
        print(path)
    return 0


def _schema(options: argparse.Namespace) -> int:
    from quadvis.catalogue import Catalogue
    from quadvis.schema import diagram_schema

    return _write(json.dumps(diagram_schema(Catalogue(Path())), indent=1) + "\n", options.output or "-")


def _new(options: argparse.Namespace) -> int:
    from quadvis.skeleton import new_block, new_diagram

    for path in (new_block if options.kind == "block" else new_diagram)(options.name):
        print(path)
    return 0


def _write(text: str, output: str) -> int:
    if output == "-":
        sys.stdout.write(text)
        return 0
    try:
        Path(output).write_text(text)
    except OSError as error:
        raise QuadvisError(f"cannot write '{output}': {error.strerror}") from error
    print(output)
    return 0
