"""Profiles as a trace in the format of Chrome, which Perfetto and chrome://tracing draw.

Format: "Trace Event Format", Google, https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from quadvis.engine.profile import ProfileReport
from quadvis.machine.files import Kind, write_output

NOTHING = ProfileReport((), (), 0.0)
TRACE = Kind("the trace", (b"{",), rb'"traceEvents"')


class TracedStep(NamedTuple):
    """A step of a task: its tick, when it began and how long it took (s)."""

    task: str
    tick: int
    begin: float
    taken: float


def write_trace(
    path: str | Path,
    profiles: Mapping[str, ProfileReport],
    steps: Mapping[str, Sequence[TracedStep]] = MappingProxyType({}),
    offsets: Mapping[str, float] = MappingProxyType({}),
) -> None:
    """Write the calls that profiles keep, by computer: a computer is a process, and a task is a thread.

    ``steps`` are drawn around the calls. ``offsets`` are the times of first calls (s) by the clock of steps.
    """
    events: list[dict[str, Any]] = []
    for number, computer in enumerate(dict.fromkeys([*profiles, *steps]), 1):
        profile = profiles.get(computer, NOTHING)
        events += _events(number, computer, profile, steps.get(computer, ()), offsets.get(computer, 0.0))
    text = json.dumps({"traceEvents": events, "displayTimeUnit": "ns"}, separators=(",", ":"))
    write_output(path, TRACE, text.encode())


def _events(
    process: int, computer: str, profile: ProfileReport, steps: Sequence[TracedStep], offset: float
) -> Iterator[dict[str, Any]]:
    names = [*(step.task for step in steps), *(method.task for method in profile.methods)]
    tasks = {name: number for number, name in enumerate(dict.fromkeys(names), 1)}
    yield _name("process_name", computer or "quadvis", process)
    for task, number in tasks.items():
        yield _name("thread_name", task, process, number)
    for step in steps:
        yield {
            "name": f"step {step.tick}", "cat": "step", "ph": "X", "pid": process, "tid": tasks[step.task],
            "ts": 1e6 * step.begin, "dur": 1e6 * step.taken,
        }  # fmt: skip
    for place, begin, taken in profile.calls:
        method = profile.methods[place]
        yield {
            "name": f"{method.block}.{method.method}", "cat": method.task, "ph": "X", "pid": process,
            "tid": tasks[method.task], "ts": 1e6 * offset + begin / 1000, "dur": taken / 1000,
        }  # fmt: skip


def _name(what: str, name: str, process: int, thread: int = 0) -> dict[str, Any]:
    return {"name": what, "ph": "M", "pid": process, "tid": thread, "args": {"name": name}}
