"""Profiles as a trace in the format of Chrome, which Perfetto and chrome://tracing draw.

Format: "Trace Event Format", Google, https://docs.google.com/document/d/1CvAClvFfyA5R-PhYUmn5OOQtYMH4h6I0nSsKchNAySU
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from quadvis.engine.profile import ProfileReport
from quadvis.machine.files import Kind, write_output

TRACE = Kind("the trace", (b"{",), rb'"traceEvents"')


def write_trace(path: str | Path, profiles: Mapping[str, ProfileReport]) -> None:
    """Write the calls that profiles keep, by computer: a computer is a process, and a task is a thread."""
    events = [event for number, item in enumerate(profiles.items(), 1) for event in _events(number, *item)]
    text = json.dumps({"traceEvents": events, "displayTimeUnit": "ns"}, separators=(",", ":"))
    write_output(path, TRACE, text.encode())


def _events(process: int, computer: str, profile: ProfileReport) -> Iterator[dict[str, Any]]:
    tasks = list(dict.fromkeys(method.task for method in profile.methods))
    yield _name("process_name", computer or "quadvis", process)
    for number, task in enumerate(tasks, 1):
        yield _name("thread_name", task, process, number)
    for place, begin, taken in profile.calls:
        method = profile.methods[place]
        yield {
            "name": f"{method.block}.{method.method}", "cat": method.task, "ph": "X", "pid": process,
            "tid": 1 + tasks.index(method.task), "ts": begin / 1000, "dur": taken / 1000,
        }  # fmt: skip


def _name(what: str, name: str, process: int, thread: int = 0) -> dict[str, Any]:
    return {"name": what, "ph": "M", "pid": process, "tid": thread, "args": {"name": name}}
