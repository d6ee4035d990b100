"""The paper's experiment: how much faster than real time it runs, and what its time goes into."""

from __future__ import annotations

import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from unittest import mock

import quadvis
from benchmarks.rows import ROOT, Row, cpu, medians
from quadvis.engine.engine import Engine
from quadvis.engine.interpreter import Interpreter
from quadvis.engine.program import COPY, Op

HOVER = ROOT / "diagrams" / "hover.yaml"
SHARES = 6  # blocks
# Variant, engine, whether there is a log, and the target.
FLIGHTS = (
    (None, "python", True, ""),
    (None, "native", True, ">= 60"),
    ("geometric", "python", True, ""),
    ("geometric", "native", True, ">= 500"),
    ("geometric", "native", False, ">= 1200"),
    ("fused_geometric", "native", True, ""),
    ("fused_geometric", "native", False, ">= 500"),
)
PARTED = ("python", True)  # such flights are shown in parts
ENGINE = "engine alone: "


def flights(rounds: int, stop_time: str | None = None) -> Iterator[Row]:
    """Measure whole runs, with both engines, with and without a log."""
    import cv2

    cv2.setNumThreads(1)
    diagrams = {
        variant: quadvis.load(HOVER, variant=variant, stop_time=stop_time)
        for variant in dict.fromkeys(variant for variant, *_ in FLIGHTS)
    }
    parted = [variant for variant, *how, _ in FLIGHTS if tuple(how) == PARTED]
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "hover.mcap")

        def work(variant: str | None, engine: str, logged: bool) -> Callable[[], float]:
            diagram, log = diagrams[variant], path if logged else None
            return lambda: cpu(lambda: diagram.run(log=log, keep=(), engine=engine))

        works = {_name(*each[:3]): work(*each[:3]) for each in FLIGHTS}
        for variant in parted:
            works[ENGINE + _name(variant, *PARTED)] = lambda d=diagrams[variant]: cpu(lambda: _fly(d))
        for each in works.values():
            each()  # machine code is kept from now on
        seconds = medians(max(1, rounds // 2), works)
    for variant, engine, logged, goal in FLIGHTS:
        name = _name(variant, engine, logged)
        yield Row(name, diagrams[variant].duration / seconds[name], "x real time", None, goal)
        if variant in parted and (engine, logged) == PARTED:
            yield from _parts(diagrams[variant], seconds[ENGINE + name] / seconds[name])


def _name(variant: str | None, engine: str, logged: bool) -> str:
    how = "machine code" if engine == "native" else "interpreted"
    return f"hover, {variant or 'rendered camera'}, {how}, {'with' if logged else 'without'} log"


def _parts(diagram: quadvis.Diagram, engine: float) -> Iterator[Row]:
    """Yield what the time of an interpreted run with a log goes into; ``engine`` is the part without log."""
    spent = shares(diagram)
    timed = sum(spent.values())
    for path, share in spent.most_common(SHARES):
        yield Row(f"  {path}", 100 * share / timed * engine, "% of the CPU")
    yield Row("  judging and log", 100 * (1 - engine), "% of the CPU")


def _fly(diagram: quadvis.Diagram) -> None:
    with Engine(diagram.graph, diagram.seed) as engine:
        engine.run(diagram.ticks)


def shares(diagram: quadvis.Diagram) -> Counter[str]:
    """Return the seconds of each block, interpreted and without log; what remains is the engine's."""
    spent: Counter[str] = Counter()
    untimed = Interpreter.call

    def timed(interpreter: Interpreter, op: Op) -> Callable[[], None]:
        call, path = untimed(interpreter, op), interpreter.program.blocks[op.block].path

        def run() -> None:
            begin = time.perf_counter()
            call()
            spent[path] += time.perf_counter() - begin

        return call if op.method == COPY else run

    with mock.patch.object(Interpreter, "call", timed), Engine(diagram.graph, diagram.seed) as engine:
        begin = time.perf_counter()
        engine.run(diagram.ticks)
        whole = time.perf_counter() - begin
    spent["engine: order, solver, checks"] = whole - sum(spent.values())
    return spent
