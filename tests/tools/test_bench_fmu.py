"""The program that measures what a step of an FMU costs."""

from __future__ import annotations

import json
from pathlib import Path

from tests.fmus import models
from tests.fmus.builder import fmu, needs_gcc

from .script import run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench_fmu"


@needs_gcc
def test_each_way_is_timed_in_each_round() -> None:
    file = fmu(models.INTEGRATOR)
    done = run_script(TOOL, file, "--rounds", "2", "--steps", "5", "--step", "0.1", "--json")
    found = json.loads(done.stdout)
    assert list(found) == ["fmpy", "bare", "in process", "isolated"]
    assert all(len(each["seconds"]) == 2 and min(each["seconds"]) > 0.0 for each in found.values())
    lines = run_script(TOOL, file, "--rounds", "1", "--steps", "5", "--step", "0.1").stdout.splitlines()
    assert [line.split("  ")[0] for line in lines] == ["a step", *found]


@needs_gcc
def test_an_fmu_of_fmi_3_is_refused() -> None:
    done = run_script(TOOL, fmu(models.INTEGRATOR, 3))
    assert done.returncode == 2 and "is not of FMI 2.0 for co-simulation" in done.stderr
