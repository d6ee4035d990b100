"""The profiler of an application: each step of its tasks as it runs, and the times of its blocks' calls."""

from __future__ import annotations

import threading
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.profile import ProfileReport
from quadvis.errors import QuadvisError
from quadvis.realtime.flight import Flight

MOST = 200_000  # steps of a task that are kept, the first ones
Steps = NDArray[np.int64]  # (N, 4): a tick, lateness and execution time of its step (ns), overruns so far


class Profiler:
    """What was found in the newest run since the profiler was started.

    Steps are taken from a run that goes on: its loop notes them anyway. Calls of blocks are timed in a run
    that begins while the profiler is on (`is_on`), and are there when it has ended. The session's thread
    gives, others ask.
    """

    def __init__(self) -> None:
        self.is_on = False
        self._lock = threading.Lock()
        self._steps: dict[tuple[str, str], list[Steps]] = {}  # by computer and task
        self._reports: dict[str, tuple[ProfileReport, int]] = {}  # by computer, with the begin from the start

    def start(self) -> None:
        """Begin anew."""
        self.clear()
        self.is_on = True

    def stop(self) -> None:
        """Take no more; what was found stays."""
        self.is_on = False

    def clear(self) -> None:
        """Forget what was found, before another run."""
        with self._lock:
            self._steps.clear()
            self._reports.clear()

    def take(self, computer: str, task: str, times: Steps) -> None:
        """Take the times of steps of a task."""
        if not self.is_on or not len(times):
            return
        with self._lock:
            kept = self._steps.setdefault((computer, task), [])
            room = MOST - sum(map(len, kept))
            if room > 0:
                kept.append(times[:room].copy())

    def end(self, flight: Flight | None) -> None:
        """Take the times of blocks from a run that has ended, if it was profiled."""
        with self._lock:
            for share in flight.shares if flight is not None else ():
                if share.profile is not None:
                    self._reports[share.computer] = share.profile, share.profile.first - share.start

    def facts(self, tick: float) -> dict[str, Any]:
        """Return what there is, without single steps and calls; ``tick`` is the base tick (s)."""
        with self._lock:
            return {
                "on": self.is_on,
                "tick": tick,
                "tasks": [
                    {"computer": computer, "task": task, "steps": sum(map(len, kept))}
                    for (computer, task), kept in self._steps.items()
                ],
                "blocks": [
                    {"computer": computer, "cost": report.cost, "offset": offset,
                     "calls": len(report.calls), "methods": [list(each) for each in report.methods]}
                    for computer, (report, offset) in self._reports.items()
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
            report, _ = _at(list(self._reports.values()), place, "computer")
            return [list(each) for each in report.calls[first : first + count]]


def _at(found: list[Any], place: int, what: str) -> Any:
    if place >= len(found):
        raise QuadvisError(f"the profiler has found nothing of a {what} with the number {place}")
    return found[place]
