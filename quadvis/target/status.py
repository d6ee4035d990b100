"""The state of a target as plain data, in the words of xPC Target."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from quadvis.graph.graph import MULTI

if TYPE_CHECKING:
    from quadvis.realtime.times import TaskTimes
    from quadvis.target.application import Application

NONE, DETECTED = "none", "detected"  # CPUOverload
NORMAL, WRAPPED = "Normal", "Wrapped"  # LogMode
MODES = {True: "Real-Time Multi-Tasking", False: "Real-Time Single-Tasking"}


def status(name: str, application: Application | None, session_time: float) -> dict[str, Any]:
    """Return what a target is and does.

    ``Application`` is "" if none is loaded; then all that belongs to one is missing. Times are in seconds.
    ``ExecTime`` is the time of the last tick. TET is that of the fastest task of the first computer.
    """
    found: dict[str, Any] = {
        "Target": name, "Application": "", "Status": "stopped", "SessionTime": session_time,
    }  # fmt: skip
    if application is None:
        return found
    diagram, session = application.diagram, application.session
    bounded = math.isfinite(application.log_samples)
    times = session.helm.times() if session is not None else {}
    tasks = [(computer, each) for computer, several in times.items() for each in several]
    found |= {
        "Application": application.name,
        "Status": application.state,
        "Mode": MODES[diagram.graph.tasking == MULTI],
        "Variant": diagram.variant or "",
        "Hash": diagram.hash,
        "ExecTime": application.time,
        "StopTime": application.stop_time,
        "SampleTime": float(diagram.graph.tick),
        "CPUOverload": DETECTED if any(each.overruns for _, each in tasks) else NONE,
        "NumSignals": len(application.newest.names),
        "NumParameters": len(application.parameters.names),
        "Tasks": [{"computer": computer, "task": each.task, **each.facts()} for computer, each in tasks],
        "MaxLogSamples": application.log_samples if bounded else None,  # JSON has no infinity
        "LogMode": WRAPPED if bounded else NORMAL,
        "NumLogWraps": session.wraps if session is not None else 0,
        "DefaultParamSet": application.default_set,
        "Log": session.log.stem if session is not None else "",
        "Problem": application.problem,
        "Said": application.said[-20:],
    }
    found |= _execution([each for _, each in tasks])
    result = application.result
    if result is not None and result.flight is not None and not (result.flight.early or diagram.here):
        found["Passed"] = result.passed
        found["Verdicts"] = [verdict.facts() for verdict in result.outcome.verdicts]
    return found


def _execution(tasks: Sequence[TaskTimes]) -> dict[str, float]:
    """Return the execution times of the fastest task; none before its first step."""
    fastest = min(tasks, key=lambda each: each.period, default=None)
    spread = fastest.execution if fastest is not None else None
    if spread is None:
        return {}
    return {"MinTET": spread.least, "AvgTET": spread.mean, "MaxTET": spread.most}
