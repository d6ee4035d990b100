"""One run of a diagram: its loop, recording, log, progress, verdicts."""

from __future__ import annotations

import json
import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from datetime import UTC, datetime
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.engine.taps import Tap
from quadvis.engine.tuning import Change
from quadvis.native.choice import AUTO, Announce
from quadvis.output.kept import ALL, RowJudge, RunSignals
from quadvis.output.recording import RecordedBlock
from quadvis.run.logged_notes import LoggedNotes, Timed
from quadvis.run.loops import SIMULATED, Paced, Progress, RunLoop, Simulated, Taken, Takers
from quadvis.run.played_files import files_text, played_files
from quadvis.run.recorded_run import COMPUTERS
from quadvis.run.result import Result
from quadvis.run.row_tap import RowTap, Taker
from quadvis.run.rows import inputs_of, signals_of
from quadvis.run.verdict import Judging, Outcome
from quadvis.version import __version__

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.output.log import LogWriter
    from quadvis.output.wrapped_log import RunLog
    from quadvis.realtime.flight import Flight
    from quadvis.realtime.options import RealTime

    OpenLog = Callable[[str | Path, Sequence[RecordedBlock], Mapping[str, str]], RunLog]


def run(
    diagram: Diagram,
    *,
    log: str | Path | None = None,
    progress: Progress | None = None,
    keep: Sequence[str] | None = None,
    engine: str = AUTO,
    announce: Announce | None = None,
    real_time: RealTime | None = None,
    profile: bool = False,
) -> Result:
    """Run a diagram to its stop time; RunError if a block fails, with a log that is readable up to that time.

    ``keep`` names the signals whose rows stay in memory, by patterns such as "craft.*". By default these are
    all signals without a log, and no signals with a log: then the result reads signals back from the log.
    Expectations and summary need no rows. A log that the disk refuses does not stop the run.

    ``engine`` is ``python``, ``native`` (machine code, compiled once and kept), or ``auto``: the one that is
    sooner through. Both give the same bits. ``announce`` takes a sentence on what is compiled or chosen.

    ``real_time`` lets every tick wait for its time, in a process of its own; see "Real time" in
    quadvis/README.md. Ticks that such a run misses have no rows.

    ``profile`` times every call of a block, which costs time itself: ``Result.profiles``.
    """
    loop: Simulated | Paced
    if real_time is None:
        loop = Simulated(diagram, engine, announce, profile)
    else:
        loop = Paced(diagram, engine, announce, replace(real_time, profile=profile))
    result = recorded(diagram, loop, log=log, progress=progress, keep=keep)
    return replace(result, profiles=loop.profiles)


def recorded(
    diagram: Diagram,
    loop: RunLoop,
    *,
    log: str | Path | None = None,
    progress: Progress | None = None,
    keep: Sequence[str] | None = None,
    taps: Sequence[Tap] = (),
    facts: Mapping[str, str] | None = None,
    open_log: OpenLog | None = None,
    timed: Timed | None = None,
) -> Result:
    """Return the result of a loop's run.

    ``facts`` are more of them for the log, ``taps`` take rows, too, and ``timed`` the times of tasks.
    ``open_log`` opens another kind of log than the file that has all rows.
    """
    signals_logged = signals_of(diagram)
    patterns = ((ALL,) if log is None else ()) if keep is None else tuple(keep)
    signals = RunSignals([each.block for each in signals_logged], diagram.ports, patterns)
    judging = Judging(diagram.summary, diagram.expectations)
    logged = [*signals_logged, *(inputs_of(diagram, loop.graphs) if log is not None else ())]
    wall, cpu = time.perf_counter(), _processor_time()
    with ExitStack() as stack:
        stack.enter_context(diagram.guarded(log))
        writer: RunLog | None = None
        notes = LoggedNotes(loop.computers, len(logged), measured=loop.measured)
        if log is not None:
            blocks = [*(each.block for each in logged), *notes.blocks]
            about = (
                metadata(diagram, loop.clock)
                | {"files": files_text(played_files(diagram))}
                | dict(facts or {})
            )
            opened: OpenLog = open_log or _writer
            writer = opened(log, blocks, about)
            stack.enter_context(writer)
        taken = []
        for index, each in enumerate(logged):
            judge = RowJudge(each.block, judging)
            takers = _takers(index, signals, writer, judge)
            if takers:
                topic = each.block.path if writer else ""
                tap = RowTap(each.node.path, each.every, diagram.graph.tick, takers, topic)
                taken.append(Taken(each.node, judge, tap))

        def change(made: Change) -> None:
            if writer:
                writer.write_change(*made)

        def tend(reached: float, spent: float) -> None:
            if writer:
                writer.flush_late()
            if progress:
                progress(reached, spent)

        choice, flight = loop.run(Takers(taken, taps, notes.taker(writer, timed), change, tend), stack)
        for row in taken:
            row.judge.flush()
        outcome = judging.outcome()
        if writer:
            closing = {} if loop.early and not flight else _closing(outcome, flight)
            writer.close(closing | ({"stopped": loop.early} if loop.early else {}))
            signals.written(writer.path, writer.loss)
    wall, cpu = time.perf_counter() - wall, _processor_time() - cpu
    lost = writer.loss if writer else ""
    duration = diagram.duration if flight is None or flight.duration is None else flight.duration
    return Result(diagram, signals, outcome, duration, wall, cpu, lost, choice, flight)


def _processor_time() -> float:
    """Return the processor time of this process and of those that it has begun and that have ended (s)."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def _writer(log: str | Path, recorded: Sequence[RecordedBlock], facts: Mapping[str, str]) -> LogWriter:
    from quadvis.output.log import LogWriter  # only a run with a log waits for this import

    return LogWriter(log, recorded, facts)


def _takers(index: int, signals: RunSignals, writer: RunLog | None, judge: RowJudge) -> list[Taker]:
    """Return the consumers of a block's rows."""
    takers: list[Taker] = []
    if index in signals.kept:
        takers.append(Taker(partial(signals.append, index), partial(signals.extend, index)))
    if writer:
        takers.append(Taker(partial(writer.write, index), partial(writer.write_rows, index)))
    if judge.names:
        takers.append(Taker(judge.take, judge.take_all))
    return takers


def metadata(diagram: Diagram, clock: str = SIMULATED) -> dict[str, str]:
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
        "folder": os.path.abspath(diagram.path.parent),
        "clock": clock,
        COMPUTERS: ", ".join(diagram.here),
        PORTS: json.dumps(dict(diagram.ports)),
        "diagram": diagram.resolved,
    }


def _closing(outcome: Outcome, flight: Flight | None) -> dict[str, str]:
    lines = {f"expect {index}": str(verdict) for index, verdict in enumerate(outcome.verdicts, 1)}
    if flight:
        lines |= {"real time": json.dumps(flight.facts())}
    return {"passed": str(outcome.passed).lower(), **lines}
