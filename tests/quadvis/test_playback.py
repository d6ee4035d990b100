"""The clock of a recorded run."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from quadvis.engine.tuning import Change
from quadvis.run.playback import RecordedClock


@given(
    st.sets(st.integers(0, 59)),
    st.lists(st.integers(0, 59), max_size=5),
    st.integers(1, 60),
)
def test_the_ticks_and_the_changes_of_the_recorded_run_come_again(
    missing: set[int], changed: list[int], size: int
) -> None:
    runs: list[list[int]] = []
    for tick in sorted(missing):
        if runs and runs[-1][0] + runs[-1][1] == tick and tick % 7:  # neighbours may be noted apart
            runs[-1][1] += 1
        else:
            runs.append([tick, 1])
    told: list[str] = []
    changes = [Change(tick, "block", str(tick), 0.0) for tick in changed if tick not in missing]
    clock = RecordedClock(
        np.array(runs, np.int64).reshape(-1, 2), changes, lambda change: told.append(change.name)
    )
    tick, ran, seen = 0, list[int](), list[tuple[int, str]]()
    while tick < 60:
        due = clock.wait(tick, min(60, tick - tick % size + size))
        seen += [(due.start, name) for name in told]
        told.clear()
        ran += due
        tick = due.stop
    assert ran == [tick for tick in range(60) if tick not in missing]
    assert seen == sorted((change.tick, change.name) for change in changes)


def test_nonsense_from_a_damaged_log_does_not_stand_still() -> None:
    nonsense = np.array([[-5, 3], [2, -9], [4, 2], [4, 2**40], [9, 0]], np.int64)
    clock = RecordedClock(nonsense, [], lambda change: None)
    tick = waits = 0
    while tick < 100:
        due = clock.wait(tick, 100)
        assert due.stop > tick
        tick, waits = due.stop, waits + 1
    assert waits < 10
