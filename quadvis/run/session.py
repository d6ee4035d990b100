"""One run of a diagram: engine or application, recording, log, progress, verdicts."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from quadvis.engine.engine import Engine
from quadvis.graph.graph import Node
from quadvis.native.choice import AUTO, Announce, Choice, choose, use
from quadvis.output.kept import ALL, RowJudge, RunSignals
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.run.result import Result
from quadvis.run.row_tap import PacedTap, RowTap, Taker
from quadvis.run.verdict import Judging, Outcome
from quadvis.version import __version__

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.output.log import LogWriter
    from quadvis.realtime.flight import Flight
    from quadvis.realtime.options import RealTime

Progress = Callable[[float, float], None]  # simulated time reached, wall time spent (s)
SLICE = 0.1  # s of wall time between two calls of the progress; Ctrl-C and rows for the log wait no longer


class Taken(NamedTuple):
    """A block whose rows are taken, by what and for which judge."""

    node: Node
    judge: RowJudge
    tap: RowTap


Loop = Callable[[Sequence[Taken], Progress, ExitStack], "tuple[Choice, Flight | None]"]


def run(
    diagram: Diagram,
    *,
    log: str | Path | None = None,
    progress: Progress | None = None,
    keep: Sequence[str] | None = None,
    engine: str = AUTO,
    announce: Announce | None = None,
    real_time: RealTime | None = None,
) -> Result:
    """Run a diagram to its stop time; RunError if a block fails, with a log that is readable up to that time.

    ``keep`` names the signals whose rows stay in memory, by patterns such as "craft.*". By default these are
    all signals without a log, and no signals with a log: then the result reads signals back from the log.
    Expectations and summary need no rows. A log that the disk refuses does not stop the run.

    ``engine`` is ``python``, ``native`` (machine code, compiled once and kept), or ``auto``: the one that is
    sooner through. Both give the same bits. ``announce`` takes a sentence on what is compiled or chosen.

    ``real_time`` lets every tick wait for its time, in a process of its own; see "Real time" in
    quadvis/README.md. Ticks that such a run misses have no rows.
    """
    begin = _simulated if real_time is None else partial(_paced, wishes=real_time)
    loop = begin(diagram, engine, announce)
    logged = [node for node in diagram.graph.nodes if diagram.logs(node.path) and _fields(node)]
    recorded = [RecordedBlock(f"/{node.path}", _fields(node), node.task.name) for node in logged]
    patterns = ((ALL,) if log is None else ()) if keep is None else tuple(keep)
    signals = RunSignals(recorded, diagram.ports, patterns)
    judging = Judging(diagram.summary, diagram.expectations)
    wall, cpu = time.perf_counter(), _processor_time()
    with ExitStack() as stack:
        stack.enter_context(diagram.guarded(log))
        facts = metadata(diagram, real_time is not None)
        writer = stack.enter_context(_writer(log, recorded, facts)) if log is not None else None
        taken = []
        for index, node in enumerate(logged):
            judge = RowJudge(recorded[index], judging)
            takers = _takers(index, signals, writer, judge)
            if takers:
                tap = RowTap(node.path, diagram.decimation(node.path), diagram.graph.tick, takers)
                taken.append(Taken(node, judge, tap))

        def tend(reached: float, spent: float) -> None:
            if writer:
                writer.flush_late()
            if progress:
                progress(reached, spent)

        choice, flight = loop(taken, tend, stack)
        for each in taken:
            each.judge.flush()
        outcome = judging.outcome()
        if writer:
            writer.close(_closing(outcome, flight))
            signals.written(writer.path, writer.loss)
    wall, cpu = time.perf_counter() - wall, _processor_time() - cpu
    lost = writer.loss if writer else ""
    return Result(diagram, signals, outcome, diagram.duration, wall, cpu, lost, choice, flight)


def _simulated(diagram: Diagram, engine: str, announce: Announce | None) -> Loop:
    """Return the loop of a simulation, with its engine ready."""
    made = Engine(diagram.graph, diagram.seed)
    choice = choose(made, diagram.ticks, engine, announce)
    use(made, choice)

    def loop(taken: Sequence[Taken], tend: Progress, stack: ExitStack) -> tuple[Choice, None]:
        for each in taken:
            made.attach(each.tap)
        stack.enter_context(made)  # to be closed when the log is
        _advance(made, diagram.ticks, tend)
        return choice, None

    return loop


def _paced(diagram: Diagram, engine: str, announce: Announce | None, wishes: RealTime) -> Loop:
    """Return the loop of a real-time run; QuadvisError if it cannot be one."""
    wishes.check(diagram.graph)
    from quadvis.realtime.supervisor import supervise  # what it needs is Unix's, and takes a while

    def loop(taken: Sequence[Taken], tend: Progress, _: ExitStack) -> tuple[Choice, Flight]:
        taps = [PacedTap(each.tap, each.node, diagram.graph, each.judge) for each in taken]
        flight = supervise(diagram, wishes, engine, taps, tend, announce)
        for tap in taps:
            tap.end(diagram.ticks)
        return flight.engine, flight

    return loop


def _processor_time() -> float:
    """Return the processor time of this process and of those that it has begun and that have ended (s)."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def _writer(log: str | Path, recorded: Sequence[RecordedBlock], facts: Mapping[str, str]) -> LogWriter:
    from quadvis.output.log import LogWriter  # only a run with a log waits for this import

    return LogWriter(log, recorded, facts)


def _takers(index: int, signals: RunSignals, writer: LogWriter | None, judge: RowJudge) -> list[Taker]:
    """Return the consumers of a block's rows."""
    takers: list[Taker] = []
    if index in signals.kept:
        takers.append(Taker(partial(signals.append, index), partial(signals.extend, index)))
    if writer:
        takers.append(Taker(partial(writer.write, index), partial(writer.write_rows, index)))
    if judge.names:
        takers.append(Taker(judge.take, judge.take_all))
    return takers


def _advance(engine: Engine, ticks: int, tend: Progress) -> None:
    """Run in slices; between slices hand rows on, show the progress and notice an interruption."""
    began = time.perf_counter()
    count = 1
    while engine.tick < ticks:
        start = time.perf_counter()
        engine.run(min(count, ticks - engine.tick))
        spent = time.perf_counter() - start
        count = max(1, min(2 * count, int(count * SLICE / max(spent, 1e-6))))
        tend(engine.time, time.perf_counter() - began)


def _fields(node: Node) -> tuple[RecordedPort, ...]:
    outputs = node.block.interface.outputs
    return tuple(
        RecordedPort(name, port.signal.scalar, node.shape(name), node.unit(name))
        for name, port in outputs.items()
        if port.signal.scalar != "frame"
    )


def metadata(diagram: Diagram, real_time: bool = False) -> dict[str, str]:
    """Return the facts of a run for its log as texts; see ``quadvis.output.log``."""
    from quadvis.output.log import PORTS

    return {
        "quadvis": __version__,
        "name": diagram.name,
        "variant": diagram.variant or "",
        "params": ", ".join(str(file.path) for file in diagram.parameter_files),
        "seed": str(diagram.seed),
        "hash": diagram.hash,
        "start": datetime.now(UTC).isoformat(timespec="seconds"),
        "python": platform.python_version(),
        "clock": "real time" if real_time else "simulated",
        PORTS: json.dumps(dict(diagram.ports)),
        "diagram": diagram.resolved,
    }


def _closing(outcome: Outcome, flight: Flight | None) -> dict[str, str]:
    lines = {f"expect {index}": str(verdict) for index, verdict in enumerate(outcome.verdicts, 1)}
    if flight:
        lines |= {"real time": json.dumps(flight.facts())}
    return {"passed": str(outcome.passed).lower(), **lines}
