"""The program that measures how many rows a log lacks after `kill -9`."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.processes import linux

from .script import loaded, run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench_log"
bench = loaded(TOOL)


def test_a_row_counts_what_is_within_the_limit() -> None:
    found = [bench.Found(0, 0.05), bench.Found(3, 0.07), bench.Found(30, 0.06)]
    assert bench.row("loop", found) == ("loop", "3", "30", "2 of 3 runs at most 10", "6.0%")


def test_rounds_are_counted_from_one_on() -> None:
    done = run_script(TOOL, "--rounds", "0")
    assert done.returncode == 2 and "'0' is not a whole number from 1 on" in done.stderr


@pytest.mark.slow
@linux
def test_a_log_lacks_few_rows_whoever_is_killed() -> None:
    found = json.loads(run_script(TOOL, "--rounds", "1", "--blocks", "2", "--json").stdout)
    assert set(found) == {"loop", "command"}
    for (each,) in found.values():
        assert 0 <= each["lacking"] <= bench.MOST and each["load"] > 0
