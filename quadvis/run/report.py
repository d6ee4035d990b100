"""The summary that `quadvis run` prints at the end of a run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import isnan
from typing import TYPE_CHECKING, Any

from quadvis.diagram.requirements import Entry
from quadvis.errors import counted
from quadvis.machine.columns import table
from quadvis.run.result import Result
from quadvis.run.verdict import Outcome, verdict_word
from quadvis.units import Unit, format_quantity

if TYPE_CHECKING:
    from quadvis.engine.profile import ProfileReport, Timed
    from quadvis.run.accuracy import Accuracy

SECOND, MILLISECOND, MICROSECOND, HERTZ = map(Unit.parse, ("s", "ms", "us", "Hz"))


def summary_lines(result: Result) -> list[str]:
    """Return the summary of a run as lines of text."""
    diagram, outcome = result.diagram, result.outcome
    variant = f" ({diagram.variant})" if diagram.variant else ""
    sets = ", ".join(file.name for file in diagram.parameter_files)
    what = f"{diagram.name}{variant}{' with ' if sets else ''}{sets}"
    lines = [f"{what}: {result.duration:g} s, seed {diagram.seed}"]
    lines += [f"  {line}" for line in table([_entry_row(entry, outcome) for entry in diagram.summary])]
    verdicts = [verdict.facts() for verdict in outcome.verdicts]
    lines += verdict_lines(verdicts)
    shown = result.duration and result.wall and not result.flight
    speed = f", {result.real_time_factor:.0f} x real time" if shown else ""
    lines.append(f"  {result.wall:.1f} s of wall time{speed}; engine: {result.engine}")
    if result.flight:
        shares = result.flight.shares
        lines += task_lines(
            [
                {"computer": share.computer, "task": each.task, **each.facts()}
                for share in shares
                for each in share.tasks
            ]
        )
        lines += [f"  {_with('real time', share.computer)}: {share.grants}" for share in shares]
    for computer, profile in result.profiles.items():
        lines += [f"  {line}" for line in profile_lines(computer, profile)]
    lines += not_judged(len(diagram.loop_requirements))
    return lines + outcome_lines(verdicts, result.passed)


def verdict_lines(verdicts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return verdicts, given as `Verdict.facts` has them, as a table."""
    rows = [(verdict_word(each), each["expectation"], each["shown"]) for each in verdicts]
    return [f"  {line}" for line in table(rows)]


def outcome_lines(verdicts: Sequence[Mapping[str, Any]], passed: bool) -> list[str]:
    """Return the line that says whether a run has passed, if anything was expected of it."""
    met = sum(each["met"] for each in verdicts)
    words = f"{'PASSED' if passed else 'FAILED'}: {met} of {len(verdicts)} expectations met"
    return [words] if verdicts else []


def task_lines(tasks: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the times of tasks, given as `TaskTimes.facts` has them with their names, as a table."""
    return [f"  {line}" for line in table(list(map(_task_row, tasks)))]


def microseconds(seconds: float) -> str:
    """Return a time in microseconds, with at least three digits: "0.512 us", "12.3 us", "8604 us"."""
    micro = 1e6 * seconds
    return f"{micro:.0f} us" if micro >= 100 else f"{micro:.3g} us"


def profile_lines(computer: str, profile: ProfileReport) -> list[str]:
    """Return the times of blocks as a table, the block with the largest share first."""
    blocks: dict[str, list[Timed]] = {}
    for method in profile.methods:
        blocks.setdefault(method.block, []).append(method)
    totals = {block: sum(method.total for method in methods) for block, methods in blocks.items()}
    whole = sum(totals.values()) or 1.0
    rare = _exceeded_by_one_in_a_hundred(profile)
    rows: list[tuple[str, ...]] = [("block", "calls", "min", "mean", "p99", "max", "share")]
    for block in sorted(totals, key=lambda block: -totals[block]):
        methods = blocks[block]
        count = sum(method.calls for method in methods)
        least, most = min(method.least for method in methods), max(method.most for method in methods)
        shown = [microseconds(time) for time in (least, totals[block] / count, rare.get(block, most), most)]
        rows.append((block, str(count), *shown, f"{100 * totals[block] / whole:.1f} %"))
    cost = f"{1e6 * profile.cost:.2g} us"
    title = f"{_with('profile', computer)}: every call timed, which costs about {cost} more a call in Python"
    return [title, *table(rows)]


def _exceeded_by_one_in_a_hundred(profile: ProfileReport) -> dict[str, float]:
    """Return for each block the time (s) that 1 in 100 of its calls exceeds, of those that are kept."""
    found: dict[str, list[int]] = {}
    for place, _, taken in profile.calls:
        found.setdefault(profile.methods[place].block, []).append(taken)
    return {block: sorted(times)[-(len(times) // 100) - 1] / 1e9 for block, times in found.items()}


def accuracy_lines(found: Accuracy) -> list[str]:
    """Return what a smaller step changes: a table, the largest change first, and the verdict."""
    changed = [each for each in found.signals if each.difference > 0.0]
    orders = ("order",) if found.tolerances is None else ("",)
    rows: list[tuple[str, ...]] = [("signal", f"{found.less} changes it by", "of its range", "at", *orders)]
    for each in changed:
        order = "-" if isnan(each.order) else f"{each.order:.1f}"
        order = order if found.tolerances is None else ""
        difference = f"{each.difference:.3g}{'' if each.unit == '1' else f' {each.unit}'}"
        rows.append((each.name, difference, f"{each.share:.2g}", f"{each.time:g} s", order))
    lines = table(rows) if changed else []
    if still := len(found.signals) - len(changed):
        lines.append(f"{counted(still, 'signal')} the same to the bit")
    return [*lines, *found.remarks, found.verdict]


def not_judged(count: int) -> list[str]:
    """Return a line on the expectations that no run judges, if there are any."""
    words = f"  not judged by a run: {counted(count, 'requirement')} on loops; 'quadvis analyse' does it"
    return [words] if count else []


def _entry_row(entry: Entry, outcome: Outcome) -> tuple[str, ...]:
    values = outcome.summary[entry.label]
    shown = ", ".join(f"{name} {entry.shows(name, value)}" for name, value in values.items())
    of = f"of {entry.selection.shows(entry.selection.of)}" if entry.selection.of else ""
    return (
        entry.label,
        shown,
        ", ".join(filter(None, (of, str(entry.selection.stretch), entry.selection.stretch.cut))),
    )


def _with(words: str, computer: str) -> str:
    return f"{words} of {computer}" if computer else words


def _task_row(task: Mapping[str, Any]) -> tuple[str, ...]:
    return (
        _with(f"task {task['task']}", task["computer"]),
        format_quantity(1 / task["period_s"], HERTZ),
        f"{counted(task['steps'], 'step')}, {counted(task['overruns'], 'overrun')}",
        *(f"{name} {_spread(task[name])}" if task[name] else "" for name in ("lateness", "execution")),
    )


def _spread(spread: Mapping[str, float]) -> str:
    shown = {"min": "min_s", "avg": "mean_s", "p99.9": "p99.9_s", "max": "max_s"}
    unit = next((unit for unit in (SECOND, MILLISECOND) if spread["max_s"] >= unit.scale), MICROSECOND)
    return ", ".join(f"{name} {spread[key] / unit.scale:.3g}" for name, key in shown.items()) + f" {unit}"
