"""What `quadvis replay` prints: whether the run is the same, and which signals differ from when on."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from quadvis.errors import counted
from quadvis.machine.columns import table
from quadvis.output.stretch import NANOSECONDS
from quadvis.run.replay import Replay
from quadvis.run.row_comparison import FoundDifference, Lack
from quadvis.version import __version__

SHOWN = 20  # signals in the table


def replay_lines(found: Replay) -> list[str]:
    """Return the report as lines of text."""
    return [*_run_lines(found), *_result_lines(found)]


def _run_lines(found: Replay) -> Iterator[str]:
    """Yield what was replayed, and from what."""
    diagram = found.diagram
    settings = f", with {', '.join(diagram.settings)}" if diagram.settings else ""
    yield f"{diagram.name}: seed {diagram.seed}, {found.clock}{settings}"
    if found.log.damage:
        yield f"  {found.log.damage}"
    elif not found.whole:
        why = found.log.summary.get("stopped") or found.log.summary.get("lost") or "rows were lost"
        yield f"  the log does not have the whole run: {why}"
    if found.played:
        yield f"  from the log: {', '.join(found.played)}"
    if found.idle:
        yield f"  not run, since they only write: {', '.join(found.idle)}"
    yield f"  compared: {counted(found.rows, 'row')} of {counted(found.signals, 'signal')}"


def _result_lines(found: Replay) -> Iterator[str]:
    """Yield the result."""
    some = f", without the {found.left_out} that the run left out" if found.left_out else ""
    upto = "" if found.whole else f", up to t = {found.time:.9g} s, as far as the log goes"
    done = f"replayed {counted(found.ticks, 'tick')}{some}{upto}"
    if found.same:
        yield f"{done}: the same to the bit"
        return
    count = len({each.difference.signal for each in found.differences})
    yield f"{done}: {count} of {counted(found.signals, 'signal')} differ"
    for lack in found.lacks:
        yield f"  {_lack_text(lack)}"
    if found.differences:
        yield f"  first {_first_text(found, found.differences[0])}"
        shown = found.differences[:SHOWN]
        yield from (f"  {line}" for line in table([_row(found, each) for each in shown]))
    if len(found.differences) > SHOWN:
        yield f"  and {counted(len(found.differences) - SHOWN, 'more signal')}; --json lists all"
    version = found.log.metadata.get("quadvis", "")
    if version != __version__:
        yield f"  the log is of quadvis {version}, the replay of quadvis {__version__}"


def _first_text(found: Replay, first: FoundDifference) -> str:
    """Return where the replay differs first."""
    difference = first.difference
    unit = difference.unit
    old, new = (f"{value} {unit}".rstrip() for value in difference.values())
    where = f"{difference.element} at tick {first.tick}, t = {_time(found, first):.9g} s"
    return f"{where}: {old} in the log, {new} in the replay"


def _row(found: Replay, each: FoundDifference) -> tuple[str, ...]:
    difference = each.difference
    return (
        difference.signal,
        f"from tick {each.tick} on",
        f"by {difference.largest:.3g} {difference.unit}".rstrip(),
        f"in {difference.count} of {counted(difference.rows, 'row')}",
    )


def _time(found: Replay, each: FoundDifference) -> float:
    return float(each.tick * found.diagram.graph.tick)


def _lack_text(lack: Lack) -> str:
    what = f"{'only the log has' if lack.only_in_log else 'the log lacks'} {counted(lack.count, 'row')}"
    return f"{what} of {lack.path}, the first at t = {lack.stamp / NANOSECONDS:.9g} s"


def replay_facts(found: Replay) -> dict[str, Any]:
    """Return the report as plain data."""
    differences = [
        {**each.difference.facts(), "tick": each.tick, "time_s": _time(found, each)}
        for each in found.differences
    ]
    return {
        "log": str(found.log.path),
        "diagram": found.diagram.name,
        "hash": found.diagram.hash,
        "seed": found.diagram.seed,
        "set": list(found.diagram.settings),
        "clock": found.clock,
        "whole": found.whole,
        "damage": found.log.damage or None,
        "ticks": found.ticks,
        "left_out": found.left_out,
        "end_s": found.time,
        "from_log": list(found.played),
        "not_run": list(found.idle),
        "signals": found.signals,
        "rows": found.rows,
        "same": found.same,
        "differences": differences,
        "lacks": [
            {"block": lack.path, "rows": lack.count, "time_s": lack.stamp / NANOSECONDS,
             "only_in": "log" if lack.only_in_log else "replay"}
            for lack in found.lacks
        ],
        "engine": found.engine.engine,
        "new_log": str(found.output) if found.output else None,
        "lost": found.lost or None,
    }  # fmt: skip
