"""The program that measures what a host costs a target, and how old a page is."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.processes import linux

from .script import loaded, run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench_target"
bench = loaded(TOOL)


def test_an_unknown_section_is_named() -> None:
    done = run_script(TOOL, "pge")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "bench_target: there is no section 'pge'; did you mean 'page'?\n"


def test_what_is_shown_ages_until_the_next_one_comes() -> None:
    ages = bench.page.Ages([10.0, 10.1, 10.3], [9.98, 10.05, 10.27])
    np.testing.assert_allclose(ages.arrival(), [0.02, 0.05, 0.03])
    shown = ages.shown()
    np.testing.assert_allclose(shown[[0, 50, 99, 101, 299]], [0.02, 0.07, 0.119, 0.051, 0.249], atol=1e-9)
    assert shown.max() < 0.25 + 1e-9


@linux
@pytest.mark.slow
def test_a_page_is_measured() -> None:
    done = run_script(TOOL, "page", "--rounds", "1", "--seconds", "2", "--engine", "python", "--json")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["samples that a page lacks"] == 0
    for name in ("values", "samples"):
        for what in ("come", "shown"):
            middle, worst = found[f"age of {name} {what}, median and p99 [ms]"]
            assert 0 < middle <= worst
    assert found["gateway, part of a core [%]"] > 0
