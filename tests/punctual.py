"""Whether a machine has kept the times of a run in real time: others may have been busy on it."""

from __future__ import annotations

from collections.abc import Sequence

from quadvis.output.log_reader import Log

LATE, MISSED = 0.05, 0.03  # s, and a share of the ticks: with more of it nobody can fly
LOOPS = ("world/imu", "target/imu", "target/control")  # of the bench


def punctual(log: Log, tasks: Sequence[str] = LOOPS) -> bool:
    """Return whether tasks were late by little, and missed few ticks.

    What a late machine can break is judged only then; what must hold however late everybody is, always.
    """
    for task in tasks:
        late, missed = log[f"_times/{task}.lateness"], log[f"_times/{task}.overruns"][-1]
        if late.max() >= LATE or missed >= MISSED * len(late):
            return False
    return True
