"""Whether the engine that a run chooses by itself is the faster one: all shipped diagrams and variants."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import yaml

import quadvis
from benchmarks.commands import QUADVIS, kept, seconds
from benchmarks.rows import ROOT, Row, medians
from quadvis.graph.devices import devices

ENGINES = ("python", "native", "auto")


def choices(rounds: int, options: Sequence[str] = ("--log", "")) -> Iterator[Row]:
    """Measure whole runs with each engine; machine code is in the cache.

    A row gives how much longer the chosen engine took than the faster one.
    """
    with kept() as environment:
        folder = Path(environment["PYTHONPYCACHEPREFIX"], "diagrams")
        shutil.copytree(ROOT / "diagrams", folder)  # some diagrams write files beside themselves
        for path in sorted(folder.glob("*.yaml")):
            variants = yaml.safe_load(path.read_text()).get("variants", {})
            for variant in (name for name in ("", *variants) if not _needs_more(path, name)):
                of = ("--variant", variant) if variant else ()
                command = (*QUADVIS, "run", str(path), *of, *options, "--engine")
                works: dict[str, Callable[[], float]] = {
                    engine: (lambda e=engine, c=command: seconds((*c, e), environment)[0])
                    for engine in ENGINES
                }
                works["native"]()  # compiles
                found = medians(rounds, works)
                python, native, auto = (found[engine] for engine in ENGINES)
                name = f"{path.name}, {variant}" if variant else path.name
                what = f"{name}: interpreted {python:.2f} s, machine code {native:.2f} s"
                yield Row(what, auto - min(python, native), "s of CPU", None, "<= 0.3")


def _needs_more(path: Path, variant: str) -> bool:
    """Return whether blocks reach a port, which only a real-time run may do, or run another program."""
    graph = quadvis.load(path, variant=variant or None).graph
    return any(devices(graph)) or any(node.block.not_restorable for node in graph.nodes)
