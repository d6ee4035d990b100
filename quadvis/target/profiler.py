"""The profiler of an application: each step of its tasks as it runs, and the times of its blocks' calls."""

from __future__ import annotations

import threading
from collections import Counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis.realtime.helm import Helm
from quadvis.realtime.profiles import BlockTimes

MOST = 200_000  # steps of a task that are kept, the first ones
Steps = NDArray[np.int64]  # (N, 4): a tick, lateness and execution time of its step (ns), overruns so far


class Profiler:
    """What was found in the newest run while the profiler was on.

    Both are taken from a run that goes on: its loop notes its steps anyway, and times the calls of blocks as
    long as the profiler is on. The session's thread gives steps, others ask.
    """

    def __init__(self) -> None:
        self._is_on = False
        self._helm: Helm | None = None
        self._lock = threading.Lock()
        self._steps: dict[tuple[str, str], list[Steps]] = {}  # by computer and task
        self._counts: Counter[tuple[str, str]] = Counter()  # how many steps these are
        self._blocks: dict[str, BlockTimes] = {}  # by computer

    def follow(self, helm: Helm) -> None:
        """Look at a new run, and forget the one before."""
        with self._lock:
            self._clear()
            self._helm = helm
            if self._is_on:
                helm.measure(True)

    def start(self) -> None:
        """Begin anew."""
        with self._lock:
            self._clear()
            self._is_on = True
            if self._helm is not None:
                self._helm.measure(True)

    def stop(self) -> None:
        """Take no more; what was found stays."""
        with self._lock:
            self._look()
            if self._is_on and self._helm is not None:
                self._helm.measure(False)
            self._is_on = False

    def _clear(self) -> None:
        self._steps.clear()
        self._counts.clear()
        self._blocks.clear()

    def _look(self) -> None:
        """Take the times of blocks up to now."""
        if self._is_on and self._helm is not None:
            self._blocks.update(self._helm.block_times())

    def take(self, computer: str, task: str, times: Steps) -> None:
        """Take the times of steps of a task."""
        if not self._is_on or not len(times):
            return
        with self._lock:
            room = MOST - self._counts[computer, task]
            if room > 0:
                self._steps.setdefault((computer, task), []).append(times[:room].copy())
                self._counts[computer, task] += min(room, len(times))

    def facts(self, tick: float) -> dict[str, Any]:
        """Return what there is, without single steps and calls; ``tick`` is the base tick (s).

        `steps` and `calls` are those that there were then, and steps that have come since.
        """
        with self._lock:
            self._look()
            return {
                "on": self._is_on,
                "tick": tick,
                "tasks": [
                    {"computer": computer, "task": task, "steps": self._counts[computer, task]}
                    for computer, task in self._steps
                ],
                "blocks": [
                    {"computer": computer, "cost": report.cost, "offset": offset,
                     "calls": len(report.calls), "methods": [list(each) for each in report.methods]}
                    for computer, (report, offset) in self._blocks.items()
                ],
            }  # fmt: skip

    def steps(self, place: int, first: int, count: int) -> list[list[int]]:
        """Return steps of the task with a place in `facts`: tick, lateness, execution time (ns), overruns."""
        with self._lock:
            kept = _at(list(self._steps.values()), place, "task")
            found: list[list[int]] = np.concatenate(kept)[first : first + count].tolist()
            return found

    def calls(self, place: int, first: int, count: int) -> list[list[int]]:
        """Return calls of the computer with a place in `facts`: the method's place, begin, time (ns)."""
        with self._lock:
            times = _at(list(self._blocks.values()), place, "computer")
            return [list(each) for each in times.report.calls[first : first + count]]


def _at(found: list[Any], place: int, what: str) -> Any:
    if place >= len(found):
        raise QuadvisError(f"the profiler has found nothing of a {what} with the number {place}")
    return found[place]
