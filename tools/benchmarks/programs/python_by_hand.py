"""Python by hand: loops over floats, as `tasks` states them."""

from __future__ import annotations

import platform
from collections.abc import Callable

from benchmarks.tasks import FACTOR, START, SUBSTEPS, Task, Values, by_definition, law, reached, runge_kutta


def load() -> str:
    """Return the version of Python."""
    return platform.python_version()


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Choose the loop."""
    loop = {"a": _hybrid, "b": by_definition, "c": lambda steps: _chain(task.count, steps)}[task.letter]
    return lambda steps: lambda: loop(steps)


def _hybrid(steps: int) -> Values:
    s: list[float] = list(START)
    for step in range(steps):
        if step % SUBSTEPS == 0:
            u = law(s)
        s = runge_kutta(s, u)
    return s


def _chain(count: int, steps: int) -> Values:
    delays = [0.0] * (count // 2)
    for _ in range(steps):
        value = 1.0
        for index, late in enumerate(delays):
            delays[index] = FACTOR * value
            value = late
    return [delays[index] for index in reached(count, steps)]
