"""The summary that `quadvis run` prints at the end of a run."""

from __future__ import annotations

from typing import TYPE_CHECKING

from quadvis.diagram.requirements import Entry
from quadvis.errors import counted
from quadvis.machine.columns import table
from quadvis.run.result import Result
from quadvis.run.verdict import Outcome, Verdict
from quadvis.units import Unit, format_quantity

if TYPE_CHECKING:
    from quadvis.engine.profile import ProfileReport, Timed
    from quadvis.realtime.times import Spread, TaskTimes

SECOND, MILLISECOND, MICROSECOND, HERTZ = map(Unit.parse, ("s", "ms", "us", "Hz"))


def summary_lines(result: Result) -> list[str]:
    """Return the summary of a run as lines of text."""
    diagram, outcome = result.diagram, result.outcome
    variant = f" ({diagram.variant})" if diagram.variant else ""
    sets = ", ".join(file.name for file in diagram.parameter_files)
    what = f"{diagram.name}{variant}{' with ' if sets else ''}{sets}"
    lines = [f"{what}: {result.duration:g} s, seed {diagram.seed}"]
    lines += [f"  {line}" for line in table([_entry_row(entry, outcome) for entry in diagram.summary])]
    lines += [f"  {line}" for line in table([_verdict_row(verdict) for verdict in outcome.verdicts])]
    shown = result.duration and result.wall and not result.flight
    speed = f", {result.real_time_factor:.0f} x real time" if shown else ""
    lines.append(f"  {result.wall:.1f} s of wall time{speed}; engine: {result.engine}")
    if result.flight:
        shares = result.flight.shares
        rows = [_task_row(share.computer, times) for share in shares for times in share.tasks]
        lines += [f"  {line}" for line in table(rows)]
        lines += [f"  {_with('real time', share.computer)}: {share.grants}" for share in shares]
    for computer, profile in result.profiles.items():
        lines += [f"  {line}" for line in profile_lines(computer, profile)]
    lines += not_judged(len(diagram.loop_requirements))
    met = sum(verdict.met for verdict in outcome.verdicts)
    if outcome.verdicts:
        count = len(outcome.verdicts)
        lines.append(f"{'PASSED' if result.passed else 'FAILED'}: {met} of {count} expectations met")
    return lines


def profile_lines(computer: str, profile: ProfileReport) -> list[str]:
    """Return the times of blocks as a table, the block with the largest share first."""
    blocks: dict[str, list[Timed]] = {}
    for method in profile.methods:
        blocks.setdefault(method.block, []).append(method)
    totals = {block: sum(method.total for method in methods) for block, methods in blocks.items()}
    whole = sum(totals.values()) or 1.0
    rows: list[tuple[str, ...]] = [("block", "calls", "min", "mean", "max", "share")]
    for block in sorted(totals, key=lambda block: -totals[block]):
        methods = blocks[block]
        count = sum(method.calls for method in methods)
        least, most = min(method.least for method in methods), max(method.most for method in methods)
        shown = [f"{1e6 * time:.3g} us" for time in (least, totals[block] / count, most)]
        rows.append((block, str(count), *shown, f"{100 * totals[block] / whole:.1f} %"))
    cost = f"{1e6 * profile.cost:.2g} us"
    title = f"{_with('profile', computer)}: every call timed, which costs about {cost} more a call in Python"
    return [title, *table(rows)]


def not_judged(count: int) -> list[str]:
    """Return a line on the expectations that no run judges, if there are any."""
    return [f"  not judged by a run: {counted(count, 'margin')}; 'quadvis analyse' does it"] if count else []


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


def _task_row(computer: str, times: TaskTimes) -> tuple[str, ...]:
    found = f"{counted(times.steps, 'step')}, {counted(times.overruns, 'overrun')}"
    late, taken = times.lateness, times.execution
    return (
        _with(f"task {times.task}", computer),
        format_quantity(1 / times.period, HERTZ),
        found,
        f"lateness {_spread(late)}" if late else "",
        f"execution {_spread(taken)}" if taken else "",
    )


def _spread(spread: Spread) -> str:
    shown = {"min": spread.least, "avg": spread.mean, "p99.9": spread.p999, "max": spread.most}
    unit = next((unit for unit in (SECOND, MILLISECOND) if spread.most >= unit.scale), MICROSECOND)
    return ", ".join(f"{name} {value / unit.scale:.3g}" for name, value in shown.items()) + f" {unit}"


def _verdict_row(verdict: Verdict) -> tuple[str, ...]:
    return "met" if verdict.met else "NOT MET", str(verdict.expectation), verdict.shown
