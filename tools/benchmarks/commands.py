"""Whole commands, each in its own process: starting, compiling, loading, sweeping."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from benchmarks.flights import HOVER
from benchmarks.programs._quadvis import text
from benchmarks.rows import ROOT, Row, medians
from benchmarks.tasks import Task
from quadvis.errors import QuadvisError

QUADVIS = (sys.executable, "-m", "quadvis")
FIRST_STEP = ("--stop-time", "0 s", "--log", "")
LOADING = "import sys; from pathlib import Path; from quadvis.api import load; load(Path(sys.argv[1]))"
LIBRARY = "from benchmarks.whole_library import compile_all; compile_all()"


def start(rounds: int) -> Iterator[Row]:
    """Measure commands to their first step; bytecode and machine code are kept from a run before."""
    geometric = (*QUADVIS, "run", str(HOVER), "--variant", "geometric", *FIRST_STEP)
    rendered = (*QUADVIS, "run", str(HOVER), *FIRST_STEP)
    commands: dict[str, tuple[Sequence[str], str]] = {
        "python -c pass": ((sys.executable, "-c", "pass"), ""),
        "python -c 'import numpy'": ((sys.executable, "-c", "import numpy"), ""),
        "quadvis --help": ((*QUADVIS, "--help"), "<= 0.15"),
        "quadvis check hover.yaml": ((*QUADVIS, "check", str(HOVER)), "<= 0.18"),
    }
    for engine in ("python", "native"):
        of = f"--engine {engine}"
        commands[f"quadvis run {of}, to the first step, geometric"] = (
            (*geometric, "--engine", engine), "<= 0.22" if engine == "python" else "",
        )  # fmt: skip
        commands[f"quadvis run {of}, to the first step, rendered camera"] = (
            (*rendered, "--engine", engine), "<= 0.45" if engine == "python" else "",
        )  # fmt: skip
    with kept() as environment:
        works = {
            name: (lambda c=command: seconds(c, environment)[0]) for name, (command, _) in commands.items()
        }
        medians(1, works)
        found = medians(max(3, rounds), works)
    bare = found["python -c pass"]
    for name, (_, goal) in commands.items():
        yield Row(name, found[name], "s of CPU", found[name] / bare, goal)


def load(rounds: int, counts: Sequence[int] = (1000, 10_000)) -> Iterator[Row]:
    """Measure how long diagrams of many blocks take to be loaded and checked, beyond an empty one."""
    goals = {1000: "<= 0.25", 10_000: "<= 1.5"}
    with kept() as environment:
        folder = Path(environment["PYTHONPYCACHEPREFIX"])
        files = {count: folder / f"chain{count}.yaml" for count in (2, *counts)}
        for count, file in files.items():
            file.write_text(text(Task("c", count)))
        works: dict[str, Callable[[], float]] = {
            str(count): (lambda f=file: seconds((sys.executable, "-c", LOADING, str(f)), environment)[0])
            for count, file in files.items()
        }
        medians(1, works)
        found = medians(rounds, works)
    for count in counts:
        value = found[str(count)] - found["2"]
        yield Row(f"loading {count} blocks", value, "s of CPU", None, goals.get(count, ""))


def cold(_: int) -> Iterator[Row]:
    """Measure the compiler: once, since it takes long. Each command finds an empty cache."""
    native = ("--engine", "native", *FIRST_STEP)
    commands: dict[str, tuple[Sequence[str], str]] = {
        "compiling hover.yaml, geometric": (
            (*QUADVIS, "run", str(HOVER), "--variant", "geometric", *native),
            "",
        ),
        "compiling hover.yaml, rendered camera": ((*QUADVIS, "run", str(HOVER), *native), "<= 20"),
        "compiling the whole library": ((sys.executable, "-c", LIBRARY), "<= 90"),
    }
    with kept() as environment:
        seconds(commands["compiling hover.yaml, geometric"][0], environment)
        for number, (name, (command, goal)) in enumerate(commands.items()):
            empty = str(Path(environment["PYTHONPYCACHEPREFIX"], f"cold{number}"))
            yield Row(
                name, seconds(command, {**environment, "QUADVIS_CACHE": empty})[0], "s of CPU", None, goal
            )


def sweep(rounds: int, seeds: int = 30, stop_time: str = "140 s") -> Iterator[Row]:
    """Measure a sweep over seeds with two workers, in wall time: it is what both cores give together."""
    with kept() as environment:
        table = Path(environment["PYTHONPYCACHEPREFIX"], "table.csv")
        command = (
            *QUADVIS, "sweep", str(HOVER), "--variant", "geometric", "--over", f"seed=0..{seeds - 1}",
            "--stop-time", stop_time, "--workers", "2", "-o", str(table), "--plot", "",
        )  # fmt: skip
        works: dict[str, Callable[[], float]] = {
            "wall": lambda: seconds(command, environment)[1], "cpu": lambda: seconds(command, environment)[0]
        }  # fmt: skip
        works["wall"]()
        found = medians(max(1, rounds // 2), works)
    name = f"sweep, {seeds} seeds, {stop_time} geometric, 2 workers"
    yield Row(f"{name}, wall", found["wall"], "s", None, "<= 4")
    yield Row(f"{name}, CPU", found["cpu"], "s of CPU")


@contextmanager
def kept() -> Iterator[dict[str, str]]:
    """Give an environment in which bytecode is kept, as on a machine where the program has run before."""
    with tempfile.TemporaryDirectory() as folder:
        paths = os.pathsep.join(str(ROOT / part) for part in ("", "blocks", "tools"))
        environment = os.environ | {"PYTHONPATH": paths, "PYTHONPYCACHEPREFIX": folder}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        yield environment


def seconds(command: Sequence[str], environment: dict[str, str]) -> tuple[float, float]:
    """Return the CPU seconds of a process and of its ended children, and its wall time.

    QuadvisError if it ends in an error. Expectations that are not met are none: a run to its first step meets
    none of them, and some seeds of a sweep do not.
    """
    begin = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    judged = FIRST_STEP[1] in command or "sweep" in command
    if process.returncode not in ((0, 1) if judged else (0,)):
        raise QuadvisError(f"'{' '.join(command)}' ended with exit code {process.returncode}")
    return usage.ru_utime + usage.ru_stime, time.perf_counter() - begin
