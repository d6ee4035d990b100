"""The summary that `quadvis run` prints at the end of a run."""

from __future__ import annotations

from quadvis.diagram.requirements import Entry
from quadvis.errors import counted
from quadvis.machine.columns import table
from quadvis.run.session import Result
from quadvis.run.verdict import Outcome, Verdict


def summary_lines(result: Result) -> list[str]:
    """Return the summary of a run as lines of text."""
    diagram, outcome = result.diagram, result.outcome
    variant = f" ({diagram.variant})" if diagram.variant else ""
    sets = ", ".join(file.name for file in diagram.parameter_files)
    what = f"{diagram.name}{variant}{' with ' if sets else ''}{sets}"
    lines = [f"{what}: {result.duration:g} s, seed {diagram.seed}"]
    lines += [f"  {line}" for line in table([_entry_row(entry, outcome) for entry in diagram.summary])]
    lines += [f"  {line}" for line in table([_verdict_row(verdict) for verdict in outcome.verdicts])]
    speed = f", {result.real_time_factor:.0f} x real time" if result.duration and result.wall else ""
    lines.append(f"  {result.wall:.1f} s of wall time{speed}; engine: {result.engine}")
    lines += not_judged(len(diagram.loop_requirements))
    met = sum(verdict.met for verdict in outcome.verdicts)
    if outcome.verdicts:
        count = len(outcome.verdicts)
        lines.append(f"{'PASSED' if result.passed else 'FAILED'}: {met} of {count} expectations met")
    return lines


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


def _verdict_row(verdict: Verdict) -> tuple[str, ...]:
    return "met" if verdict.met else "NOT MET", str(verdict.expectation), verdict.shown
