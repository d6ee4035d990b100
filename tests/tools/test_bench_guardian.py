"""The program that measures how soon an output is safe."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from .script import loaded, run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench_guardian"
bench = loaded(TOOL)


def test_limits_are_times_or_periods() -> None:
    assert [bench.limit(name, 100) for name in ("kill", "hang", "stop", "interrupt")] == [
        0.01,
        0.03,
        0.03,
        0.01,
    ]


def test_a_row_counts_what_is_within_the_limit() -> None:
    assert bench.row("kill", [0.001, 0.002, 0.011], 0.01) == (
        "kill", "2.00 ms", "11.00 ms", "10.00 ms", "2 of 3"
    )  # fmt: skip


def test_an_unknown_end_is_refused() -> None:
    done = run_script(TOOL, "--ends", "kill,crash")
    assert done.returncode == 2
    assert "'crash' is none of kill, hang, stop, interrupt" in done.stderr


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
def test_each_end_is_timed_once_a_round() -> None:
    found = json.loads(run_script(TOOL, "--rounds", "1", "--json").stdout)
    assert list(found) == [*bench.ENDS, bench.BARE]
    assert all(len(found[name]["seconds"]) == 1 for name in bench.ENDS)
    assert len(found[bench.BARE]["seconds"]) == len(bench.ENDS) * bench.TRIPS
    assert all(each > 0 for one in found.values() for each in one["seconds"])
