"""Python by hand, compiled by numba: the same loops as in by_hand.c."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from benchmarks import tasks
from benchmarks.tasks import FACTOR, START, STEP, SUBSTEPS, Task, Values


def load() -> str:
    """Return the version."""
    import numba

    return numba.__version__


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Compile the loop of a task, and the functions of `tasks` that it calls."""
    import numpy as np

    make = {"a": _hybrid, "b": _discrete, "c": _chain}[task.letter]
    loop = make()

    def prepare(steps: int) -> Callable[[], Values]:
        if task.letter == "c":
            delays = np.zeros(task.count // 2)
            return lambda: loop(delays, steps)[tasks.reached(task.count, steps)]
        states = np.array(START)
        return lambda: loop(states, steps)

    prepare(1)()
    return prepare


def _compiled(*names: str) -> dict[str, Any]:
    """Return functions of `tasks`, compiled, each with those before it."""
    import types

    from numba import njit

    scope = dict(vars(tasks))
    for name in names:
        plain = scope[name]
        scope[name] = njit(types.FunctionType(plain.__code__, scope, name))
    return scope


def _hybrid() -> Any:
    from numba import njit

    scope = _compiled("limited", "nested", "law", "slopes")
    law, slopes = scope["law"], scope["slopes"]
    as_tuple = _as_tuple()

    @njit
    def add(s: Any, factor: float, rates: Any, t: Any) -> None:
        for index in range(12):
            t[index] = s[index] + factor * rates[index]

    @njit
    def loop(s: Any, steps: int) -> Any:
        t = s.copy()
        u = law(as_tuple(s))
        for step in range(steps):
            if step % SUBSTEPS == 0:
                u = law(as_tuple(s))
            k1 = slopes(s, u)
            add(s, 0.5 * STEP, k1, t)
            k2 = slopes(t, u)
            add(s, 0.5 * STEP, k2, t)
            k3 = slopes(t, u)
            add(s, STEP, k3, t)
            k4 = slopes(t, u)
            for index in range(12):
                s[index] += STEP / 6.0 * (k1[index] + 2.0 * k2[index] + 2.0 * k3[index] + k4[index])
        return s

    return loop


def _discrete() -> Any:
    from numba import njit

    scope = _compiled("limited", "nested", "law", "slopes")
    law, slopes = scope["law"], scope["slopes"]
    as_tuple = _as_tuple()

    @njit
    def loop(s: Any, steps: int) -> Any:
        held = (0.0, 0.0, 0.0, 0.0)
        for _ in range(steps):
            u = law(as_tuple(s))
            rates = slopes(s, held)
            for index in range(12):
                s[index] += STEP * rates[index]
            held = u
        return s

    return loop


def _as_tuple() -> Any:
    """Return the compiled function that makes a tuple of 12 states, which `law` unpacks."""
    from numba import njit

    return njit(lambda s: (s[0], s[1], s[2], s[3], s[4], s[5], s[6], s[7], s[8], s[9], s[10], s[11]))


def _chain() -> Any:
    from numba import njit

    @njit
    def loop(delays: Any, steps: int) -> Any:
        for _ in range(steps):
            value = 1.0
            for index in range(len(delays)):
                late = delays[index]
                delays[index] = FACTOR * value
                value = late
        return delays

    return loop
