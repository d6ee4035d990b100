"""The priorities of tasks over the computers of a diagram."""

from __future__ import annotations

import quadvis
from quadvis.api import load_text
from quadvis.realtime.options import RealTime
from quadvis.realtime.priorities import ladders

TEXT = """
quadvis: 1
name: two
tasking: multi
overload: {action: warn}
stop_time: 1 s
rates: {fast: 100 Hz, often: 50 Hz, slow: 10 Hz}
computers: {near: {}, far: {FAR}}
blocks:
  a: {block: sources.constant, rate: fast, at: near, with: {value: 1}}
  b: {block: sources.constant, rate: slow, at: near, with: {value: 1}}
  c: {block: sources.constant, rate: often, at: far, with: {value: 1}}
  d: {block: sources.constant, rate: slow, at: far, with: {value: 1}}
"""


def found(far: str = "", priority: int | None = None) -> dict[str, tuple[int, ...]]:
    diagram = load_text(TEXT.replace("FAR", far))
    asked = {name: RealTime(priority=priority).on(diagram.computer(name)) for name in diagram.computers}
    return ladders(diagram, asked)


def test_a_task_that_is_due_more_often_goes_first_whichever_computer_it_is_of() -> None:
    assert found() == {"near": (80, 78), "far": (79, 78)}
    assert found(priority=50) == {"near": (50, 48), "far": (49, 48)}


def test_a_priority_of_the_diagram_is_that_of_the_computers_own_fastest_task() -> None:
    assert found(far="priority: 85") == {"near": (80, 78), "far": (85, 84)}


def test_without_priority_no_task_has_one_and_none_falls_below_the_lowest() -> None:
    assert found(priority=0) == {"near": (0, 0), "far": (0, 0)}
    assert found(priority=1) == {"near": (1, 1), "far": (1, 1)}


def test_the_loop_of_a_computer_says_which_priority_it_has() -> None:
    result = load_text(TEXT.replace("FAR", "").replace("stop_time: 1 s", "stop_time: 0.1 s")).run(
        real_time=quadvis.RealTime(poll="0 s")
    )
    assert result.flight is not None
    for share, priority in zip(result.flight.shares, (80, 79), strict=True):
        assert f"SCHED_FIFO {priority}" in f"{share.grants}{share.grants.refused}"
