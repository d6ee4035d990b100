"""What the profiler of a target has found: each step of its tasks, and the times of its blocks' calls."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis.errors.caller import as_given

if TYPE_CHECKING:
    from quadvis.engine.profile import ProfileReport
    from quadvis.host.target import Target

LOOK = 0.2  # s between two looks whether a run that is timed goes on
PIECE = 10_000  # steps or calls in one message
NANOSECONDS = 1e9


@dataclass(frozen=True, eq=False)
class TaskSteps:
    """The N steps of a task: their ticks (N,), when they began, were due and how long they took (N,), in s.

    In a step that faster tasks interrupt the time of these is in ``execution``, the turnaround time.
    ``overruns`` are those of the task from the first of these steps to the last.
    """

    computer: str
    task: str
    ticks: NDArray[np.int64]
    due: NDArray[np.float64]
    lateness: NDArray[np.float64]
    execution: NDArray[np.float64]
    overruns: int

    @property
    def begin(self) -> NDArray[np.float64]:
        """When each step began, from the start of the run (s)."""
        return self.due + self.lateness


@dataclass(frozen=True, eq=False)
class ProfilerData:
    """The steps of tasks, and the times of blocks by computer; see xPC Target's profiler.

    ``offsets`` say when the first call of each computer's profile began, from the start of the run (s).
    """

    tasks: Sequence[TaskSteps]
    profiles: Mapping[str, ProfileReport]
    offsets: Mapping[str, float]

    def report(self) -> str:
        """Return tables: the steps of each task, the times of each block."""
        from quadvis.machine.columns import table
        from quadvis.run.report import microseconds, profile_lines

        head = ("task", "steps", "overruns", "execution min", "mean", "max", "lateness max")
        rows: list[tuple[str, ...]] = [head]
        for each in self.tasks:
            taken, late = each.execution, each.lateness
            shown = [microseconds(time) for time in (taken.min(), taken.mean(), taken.max(), late.max())]
            name = f"{each.computer} {each.task}".strip()
            rows.append((name, str(len(each.ticks)), str(each.overruns), *shown))
        lines = list(table(rows)) if self.tasks else ["no steps"]
        for computer, profile in self.profiles.items():
            lines += ["", *profile_lines(computer, profile)]
        return "\n".join(lines)

    def write(self, path: str | Path) -> Path:
        """Write steps and calls as a trace for Perfetto or chrome://tracing; return the path."""
        from quadvis.run.trace import TracedStep, write_trace

        steps: dict[str, list[TracedStep]] = {}
        for each in self.tasks:
            steps.setdefault(each.computer, []).extend(
                TracedStep(each.task, tick, begin, taken)
                for tick, begin, taken in zip(
                    each.ticks.tolist(), each.begin.tolist(), each.execution.tolist(), strict=True
                )
            )
        write_trace(path, self.profiles, steps, self.offsets)
        return Path(path)

    def __str__(self) -> str:
        return self.report()


def profiled(target: Target, duration: str | float) -> ProfilerData:
    """Time what a target runs for so long, see `Target.profile`."""
    from quadvis.diagram.times import read_duration
    from quadvis.document import YamlScalar

    text = duration if isinstance(duration, str) else f"{duration} s"
    seconds = float(read_duration(YamlScalar(text, False, as_given("--seconds", "duration"), 0, 0)))
    if target.Status != "running":
        raise QuadvisError(f"nothing runs on {target.name}, so there is nothing to time; start it first")
    target.startProfiler()
    try:
        end = time.monotonic() + seconds
        while (left := end - time.monotonic()) > 0 and target.Status == "running":
            time.sleep(min(left, LOOK))
    finally:
        target.stopProfiler()
    return target.getProfilerData()


def profiler_data(request: Callable[..., Any]) -> ProfilerData:
    """Return what the profiler of the target has found that ``request`` asks."""
    from quadvis.engine.profile import ProfileReport, Timed

    facts = request("getprofilerdata")

    def pieces(count: int, width: int, **which: int) -> NDArray[np.int64]:
        found = [np.zeros((0, width), np.int64)]
        for first in range(0, count, PIECE):
            found.append(np.array(request("getprofilerdata", first=first, count=PIECE, **which), np.int64))
        return np.concatenate(found)

    tasks = []
    for place, each in enumerate(facts["tasks"]):
        steps = pieces(each["steps"], 4, task=place)
        ticks, late, taken, overruns = steps.T
        tasks.append(
            TaskSteps(
                each["computer"], each["task"], ticks, ticks * facts["tick"], late / NANOSECONDS,
                taken / NANOSECONDS, int(overruns[-1] - overruns[0]),
            )
        )  # fmt: skip
    profiles = {}
    for place, each in enumerate(facts["blocks"]):
        calls = tuple(map(tuple, pieces(each["calls"], 3, computer=place).tolist()))
        methods = tuple(Timed(*method) for method in each["methods"])
        profiles[each["computer"]] = ProfileReport(methods, calls, each["cost"])
    offsets = {each["computer"]: each["offset"] / NANOSECONDS for each in facts["blocks"]}
    return ProfilerData(tasks, profiles, offsets)
