"""`quadvis run FILE --target NAME`: load, start, wait, and bring the log and the verdicts home."""

from __future__ import annotations

import argparse
import json
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any

from quadvis.errors import QuadvisError
from quadvis.machine.status_line import ProgressLine
from quadvis.units import Unit, format_quantity

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.host.target import Target

LOOK = 0.2  # s between two looks at the status
SECOND = Unit.parse("s")
FAILED = 1


def run_on_target(diagram: Diagram, log: Path | None, options: argparse.Namespace) -> int:
    """Fly a diagram on a target to its stop time; 1 if it misses an expectation or ends early.

    This process is the operator meanwhile: if it is lost, the target does what the diagram's `on_host_loss`
    says. Ctrl-C stops the run, and the log comes home all the same.
    """
    from quadvis.host.target import Target

    with Target(options.target) as tg, tg.operator():
        tg.load(diagram, engine=options.engine)
        try:
            tg.start()
            _wait(tg, diagram)
        except KeyboardInterrupt:
            state = tg.Status
            if state in ("running", "stopping"):
                tg.stop()
            if state in ("running", "stopping", "stopped"):  # else it has not begun, and has no log
                _bring(tg, log)
            raise
        found = tg.status()
        place = _bring(tg, log)
    _print(diagram, found, options)
    if place:
        print(f"log: {place}")
    if found["Problem"]:
        print(found["Problem"], file=sys.stderr)
    return 0 if found.get("Passed") else FAILED


def run_on_several(diagram: Diagram, log: Path | None, options: argparse.Namespace) -> int:
    """Fly a diagram on several targets, each as one of its computers or several; as `run_on_target` besides.

    The logs go into a folder with the name of the log, without its ending.
    """
    from quadvis.host.several import Several, read_places
    from quadvis.host.target import Target

    with ExitStack() as stack:
        places = read_places(options.on)
        met = {place: stack.enter_context(Target(place)) for place in dict.fromkeys(places.values())}
        targets = {name: met[place] for name, place in places.items()}
        several = stack.enter_context(Several(diagram, targets))
        several.load(options.engine)
        try:
            several.start()
            with ProgressLine(diagram.duration) as progress:
                several.wait(progress, progress.say)
        except KeyboardInterrupt:
            several.stop()
            raise
        folder = (log or Path("runs/several.mcap")).with_suffix("")
        folder.mkdir(parents=True, exist_ok=True)
        logs = several.logs(folder)
        outcome = several.judge(logs)
        tasks = [task for target in several.those_left for task in target.Tasks]
    verdicts = [verdict.facts() for verdict in outcome.verdicts]
    complaints = several.complaints
    passed = outcome.passed and not complaints
    if options.json:
        facts = {"Passed": passed, "Verdicts": verdicts, "Tasks": tasks, "Problem": "; ".join(complaints)}
        print(json.dumps({"diagram": diagram.name, "targets": places} | facts | {"logs": str(folder)}))
        return 0 if passed else FAILED
    print(f"{diagram.name} on {', '.join(f'{name} ({place})' for name, place in places.items())}")
    print("\n".join(_lines(verdicts, tasks, passed)))
    for name, offset in several.offsets.items():
        print(f"  clock of {name}: known to {format_quantity(offset.error / 1e9, SECOND, 2)}")
    print(f"logs: {folder}")
    print("".join(f"{complaint}\n" for complaint in complaints), end="", file=sys.stderr)
    return 0 if passed else FAILED


def _wait(tg: Target, diagram: Diagram) -> None:
    """Wait for the end of the run, and show how far it is."""
    began = time.monotonic()
    with ProgressLine(diagram.duration) as progress:
        while True:
            found = tg.status()
            if found["Status"] not in ("running", "stopping"):
                return
            progress(found["ExecTime"], time.monotonic() - began)
            time.sleep(LOOK)


def _bring(tg: Target, log: Path | None) -> Path | None:
    return tg.fetchlog(path=log) if log is not None else None


def _print(diagram: Diagram, found: dict[str, Any], options: argparse.Namespace) -> None:
    """Print the verdicts and the times of the tasks."""
    if options.json:
        print(json.dumps(found))
        return
    variant = f" ({diagram.variant})" if diagram.variant else ""
    print(f"{diagram.name}{variant} on {found['Target']}: {found['ExecTime']:g} s")
    print("\n".join(_lines(found.get("Verdicts", []), found.get("Tasks", []), found.get("Passed", False))))


def _lines(verdicts: Sequence[Any], tasks: Sequence[Any], passed: bool) -> list[str]:
    from quadvis.run.report import outcome_lines, task_lines, verdict_lines

    return [*verdict_lines(verdicts), *task_lines(tasks), *outcome_lines(verdicts, passed)]


def check_options(options: argparse.Namespace) -> None:
    """Refuse options that mean nothing on a target."""
    for name in ("real_time", "cpu", "priority", "poll", "profile"):
        if getattr(options, name, None):
            option = f"--{name.replace('_', '-')}"
            raise QuadvisError(f"{option} is for a run on this machine; a target always runs in real time")
