"""The program that measures what faults cost."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.processes import linux

from .script import loaded, run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench_faults"
bench = loaded(TOOL)


def test_a_figure_is_within_its_limit_or_not() -> None:
    assert bench.Figure(8, "safe", 9.0, 10).met and not bench.Figure(8, "safe", 10.1, 10).met
    assert bench.Figure(4, "share", 80, 75, "%", least=True).met
    cells = bench.Figure(8, "safe", 12.345, 10).cells()
    assert cells == ("8", "safe", "12.35 ms", "at most 10 ms", "NOT MET")


def test_an_unknown_section_is_refused() -> None:
    done = run_script(TOOL, "lines")
    assert done.returncode == 2 and "did you mean 'line'" in done.stderr


@pytest.mark.slow
@linux
def test_figures_are_printed_with_their_rows() -> None:
    found = json.loads(run_script(TOOL, "line", "diagrams", "--json").stdout)
    assert [each["row"] for each in found] == [4, 12, 12]
    assert found[0]["met"] and all(each["value"] > 0 for each in found)
