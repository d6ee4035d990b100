"""How many ticks a run has: a run that would never end is a fault of its rates, its step or its stop time."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from fractions import Fraction

from quadvis.diagram.sections.rates import RATES
from quadvis.diagram.sections.solver import SOLVER
from quadvis.diagram.spec import FileSpec
from quadvis.diagram.times import rate_text, time_text
from quadvis.errors import UNKNOWN, Faults, Place, known
from quadvis.graph.graph import Task, common_divisor, rate_monotonic

MOST = 10**9  # hours of computing, even without a block


def check_ticks(
    spec: FileSpec, used: Collection[Task], step: Fraction | None, stop: Fraction, faults: Faults
) -> None:
    """Report a run of too many ticks, with those of the rates in use that make it so."""
    tasks = rate_monotonic(used)
    if not tasks or stop / (step or _tick(tasks)) < MOST:
        return
    run = f"a run of {time_text(stop)}"
    if step is not None:
        problem = f"with a step of {time_text(step)} {run} {_count(stop / step)}"
        place = spec[SOLVER].place or spec.place
        faults.add(place, problem, "choose a larger step or a shorter stop time", subject="")
        return
    guilty = _guilty(tasks, stop)
    place = max(_place(spec, task) for task in guilty)
    count = _count(stop / _tick(guilty))
    if len(guilty) == 1 and not guilty[0].offset:
        problem = f"at the rate '{guilty[0].name}' ({_rate(guilty[0])}) {run} {count}"
        faults.add(place, problem, "choose a slower rate or a shorter stop time", subject="")
        return
    names = [f"'{task.name}' ({_rate(task)})" for task in guilty]
    those = (
        f"the rates {', '.join(names[:-1])} and {names[-1]}"
        if names[1:]
        else f"period and offset of {names[0]}"
    )
    problem = f"{those} have no common measure longer than {float(_tick(guilty)):.3g} s, so {run} {count}"
    remedy = "choose periods and offsets that are multiples of a longer time, such as 1 ms"
    faults.add(place, problem, remedy, subject="")


def _count(ticks: Fraction) -> str:
    return f"has {float(ticks):.3g} ticks, and must have fewer than 1e9"


def _guilty(tasks: Sequence[Task], stop: Fraction) -> list[Task]:
    """Return as few tasks as have too many ticks together."""
    guilty = list(tasks)
    for task in reversed(tasks):  # the slowest first: the fastest are to blame
        others = [other for other in guilty if other is not task]
        if others and stop / _tick(others) >= MOST:
            guilty = others
    return guilty


def _tick(tasks: Sequence[Task]) -> Fraction:
    return common_divisor([time for task in tasks for time in (task.period, task.offset) if time])


def _rate(task: Task) -> str:
    offset = f", offset {time_text(task.offset)}" if task.offset else ""
    return rate_text(task).removeprefix(f"{task.name}, ") + offset


def _place(spec: FileSpec, task: Task) -> Place:
    rate = spec[RATES].get(task.name, UNKNOWN)
    return rate.place if known(rate) else spec.place
