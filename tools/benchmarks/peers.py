"""quadvis beside other programs and beside C by hand, on the tasks of `tasks`.

Each program has a process of its own for each task. Its values are compared with what comes out of the task
before its time counts. All programs run in turn within a round, so that what else the machine does meets all.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from importlib import import_module
from typing import Any, NamedTuple, Self

from benchmarks.rows import ROOT
from benchmarks.tasks import Task

TASKS = ("a", "b", "c100", "c1000", "c10000")
C = "c"
OURS = ("quadvis_native", "quadvis_python", "python_by_hand", "numba_by_hand", C)  # in quadvis's environment
PROGRAMS = {
    C: "C by hand",
    "numba_by_hand": "numba by hand",
    "quadvis_native": "quadvis, machine code",
    "jaxonomy": "Jaxonomy",
    "python_by_hand": "Python by hand",
    "quadvis_python": "quadvis, interpreted",
    "drake": "Drake",
    "pysimblocks": "pySimBlocks",
    "bdsim": "bdsim",
    "pathsim": "PathSim",
}
KEPT = "quadvis_native"  # its machine code is kept from process to process
GOALS = {"a": "<= 2.5 x C", "b": "<= 6 ns", "c": "<= 6 ns"}
GROWTH = 16  # of the steps of a run, until it is long enough
RUNS = 50  # at most, for one time
OVERHEADS = 3


class PeerRow(NamedTuple):
    """One program on one task.

    ``step`` and ``block`` are CPU time for each step, and for each block and step (ns); ``ratio`` is that of
    the step to C by hand, the median over the rounds. ``load``, ``build`` and ``cold`` (s of CPU): to import;
    to make the model up to its first step; the same when no machine code is kept. ``error`` is the largest
    difference from the expected values. ``note`` says why there is no figure.
    """

    task: str
    program: str
    version: str = ""
    step: float | None = None
    block: float | None = None
    ratio: float | None = None
    load: float | None = None
    build: float | None = None
    cold: float | None = None
    error: float | None = None
    note: str = ""
    goal: str = ""

    def __str__(self) -> str:
        name = f"{self.task:8}{self.program} {self.version}".rstrip()
        if self.note:
            return f"{name}: {self.note}"
        each = f"{self.step:.4g} ns a step" if self.block is None else f"{self.block:.3g} ns a block and step"
        ratio = "" if self.ratio is None else f"{self.ratio:.3g} x C"
        times = f"import {self.load:.2f} s, build {self.build:.2f} s"
        cold = "" if self.cold is None else f", cold {self.cold:.1f} s"
        return f"{name:46}{each:32}{ratio:>12}   {times}{cold}, error {self.error:.0e}  {self.goal}".rstrip()


class WorkerError(Exception):
    """A program ended, or gives wrong values."""


class Worker:
    """A program on a task, in a process of its own."""

    def __init__(self, program: str, task: Task, python: str, **environment: str) -> None:
        self.program, self.task = program, task
        paths = [ROOT / "tools", ROOT, ROOT / "blocks"] if program in OURS else [ROOT / "tools"]
        self._process = subprocess.Popen(
            [python, "-m", "benchmarks.worker", program, task.name],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, paths)), **environment},
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._process.kill()
        self._process.communicate()

    def answer(self) -> dict[str, Any]:
        """Wait for the next answer."""
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise WorkerError(f"it ended with exit code {self._process.wait()}")
        found: dict[str, Any] = json.loads(line)
        if "failed" in found:
            raise WorkerError(f"it failed: {found['failed']}")
        return found

    def run(self, steps: int) -> tuple[float, list[float]]:
        """Run so many steps from the start; return the CPU seconds and the values."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{steps}\n")
        self._process.stdin.flush()
        found = self.answer()
        return found["seconds"], found["values"]


class Timed:
    """A worker whose values are right, and how many steps it takes for a run of about ``budget`` seconds."""

    def __init__(
        self, worker: Worker, facts: dict[str, Any], expected: Sequence[float], budget: float
    ) -> None:
        self.worker, self.facts = worker, facts
        steps = worker.task.check
        seconds, values = worker.run(steps)
        self.error = max(abs(a - b) for a, b in zip(values, expected, strict=True))
        if not self.error <= worker.task.tolerance:
            raise WorkerError(f"its values are wrong by {self.error:.1e}")
        self._overhead = statistics.median(worker.run(1)[0] for _ in range(OVERHEADS))
        while seconds < budget / 2 and steps < worker.task.most:
            wanted = int(steps * budget / max(seconds, budget / GROWTH))
            steps = min(max(wanted, steps + 1), worker.task.most)
            seconds, _ = worker.run(steps)
        self._steps, self._budget = steps, budget
        self.times: list[float] = []  # of a step (s)

    def measure(self) -> None:
        """Add the time of a step, without what a run costs before its first step."""
        seconds: list[float] = []
        while len(seconds) < RUNS and sum(seconds) < self._budget / 2:
            seconds.append(max(self.worker.run(self._steps)[0] - self._overhead, 0.0))
        self.times.append(sum(seconds) / len(seconds) / (self._steps - 1))


def peers(
    rounds: int, tasks: Sequence[str], programs: Sequence[str], python: str, budget: float
) -> Iterator[PeerRow]:
    """Measure programs on tasks; ``python`` is the interpreter in whose environment the others are."""
    for name in tasks:
        yield from _task(rounds, Task.named(name), programs, python, budget)


def _task(rounds: int, task: Task, programs: Sequence[str], python: str, budget: float) -> Iterator[PeerRow]:
    expected = task.expected(task.check)
    cold: dict[str, float] = {}
    timed: dict[str, Timed] = {}
    with ExitStack() as stack:
        cache = stack.enter_context(tempfile.TemporaryDirectory())
        for name in programs:
            most = getattr(import_module(f"benchmarks.programs.{name}"), "MOST", None)
            if most is not None and task.blocks > most:
                yield PeerRow(task.name, PROGRAMS[name], note=f"not tried with more than {most} blocks")
                continue
            interpreter = sys.executable if name in OURS else python
            if name == KEPT:  # its first process fills the cache
                with Worker(name, task, interpreter, QUADVIS_CACHE=cache) as worker:
                    cold[name] = worker.answer()["build"]
            worker = stack.enter_context(Worker(name, task, interpreter, QUADVIS_CACHE=cache))
            try:
                facts = worker.answer()
                if "missing" in facts:
                    yield PeerRow(task.name, PROGRAMS[name], note=f"not installed: {facts['missing']}")
                else:
                    timed[name] = Timed(worker, facts, expected, budget)
            except WorkerError as error:
                yield PeerRow(task.name, PROGRAMS[name], note=str(error))
        for _ in range(rounds):
            for each in timed.values():
                each.measure()
    for name, each in timed.items():
        step = statistics.median(each.times)
        ratio = None
        if C in timed:
            pairs = zip(each.times, timed[C].times, strict=True)
            ratio = statistics.median(mine / its for mine, its in pairs)
        yield PeerRow(
            task.name, PROGRAMS[name], each.facts["version"], step * 1e9,
            step * 1e9 / task.blocks if task.blocks else None, ratio,
            each.facts["load"], each.facts["build"], cold.get(name), each.error,
            goal=GOALS[task.letter] if name == KEPT else "",
        )  # fmt: skip
