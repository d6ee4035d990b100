"""The rows of the tables, and how times are taken for them."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

ROOT = Path(__file__).parents[2]


class Row(NamedTuple):
    """One measured figure: ``ratio`` is relative to the first row of its table, ``goal`` is its target."""

    what: str
    value: float
    unit: str
    ratio: float | None = None
    goal: str = ""

    def __str__(self) -> str:
        ratio = f"{self.ratio:8.3g} x" if self.ratio is not None else " " * 10
        value = f"{self.value:9.3g} {self.unit}"
        return f"{self.what:64}{value:24}{ratio}  {self.goal}".rstrip()


def cpu(work: Callable[[], object]) -> float:
    """Return the CPU seconds of some work in this process."""
    begin = time.process_time()
    work()
    return time.process_time() - begin


def medians(rounds: int, works: dict[str, Callable[[], float]]) -> dict[str, float]:
    """Measure all rows in turn, several times."""
    found: dict[str, list[float]] = {name: [] for name in works}
    for _ in range(rounds):
        for name, work in works.items():
            found[name].append(work())
    return {name: statistics.median(values) for name, values in found.items()}
