"""Times of a diagram: rates, steps and durations, all of them exact fractions of a second."""

from __future__ import annotations

from fractions import Fraction

from quadvis.document import YamlNode, YamlScalar
from quadvis.graph.graph import Task
from quadvis.units import Unit, format_quantity, split_quantity

SECOND = Unit.parse("s")
SHORTEST, LONGEST = Fraction(1, 10**9), Fraction(10**9)  # s: the log counts nanoseconds


def read_period(node: YamlNode) -> Fraction:
    """Read a rate or a period; a number without unit is asked for one."""
    period = node.period()
    if not SHORTEST <= period <= LONGEST:
        problem = f"'{node.key}': the period must be between 1e-9 s and 1e9 s"
        raise node.fault(problem, "write such as '20 Hz'")
    return period


def read_duration(node: YamlNode) -> Fraction:
    """Read a time that is not negative."""
    number, unit = split_quantity(node.value) if isinstance(node, YamlScalar) else ("", "")
    if not number and not unit:
        raise node.wrong("a time such as '20 s'")
    if not unit and number.strip("0.+-"):
        label = f"'{node.key}': " if node.key else ""
        raise node.fault(f"{label}'{number}' has no unit", f"did you mean '{number} s'?")
    value = node.exact(SECOND)
    if not 0 <= value <= LONGEST:
        label = f"'{node.key}'" if node.key else "a time"
        raise node.fault(f"{label} must be between 0 s and 1e9 s", "write one such as '20 s'")
    return value


def read_step(node: YamlNode) -> Fraction:
    """Read the step of a solver, mostly written as a time."""
    if isinstance(node, YamlScalar) and not split_quantity(node.value)[1]:
        read_duration(node)
    return read_period(node)


def time_text(time: Fraction) -> str:
    """Return a time for people, exactly: a decimal number if it is one."""
    is_decimal = (10**12 * time).denominator == 1
    return format_quantity(float(time), SECOND, 12) if is_decimal else f"{time} s"


def rate_text(task: Task) -> str:
    """Return a task's name and rate as a message shows them."""
    frequency = 1 / task.period
    rate = f"{frequency} Hz" if frequency.denominator == 1 else f"{float(task.period):g} s"
    return f"{task.name}, {rate}"
