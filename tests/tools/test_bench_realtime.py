"""The program that measures real-time runs, beside a cyclictest that is a script."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from .script import loaded, run_script

TOOL = Path(__file__).parents[2] / "tools" / "bench_realtime"
bench = loaded(TOOL)
SCRIPT = """\
#!/bin/sh
echo "# /dev/cpu_dma_latency"
echo "000010 000095"
echo "000020 000004"
echo "000300 000001"
echo "# Total: 000000100"
"""


@pytest.fixture
def cyclictest(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    script = tmp_path / "cyclictest"
    script.write_text(SCRIPT)
    script.chmod(0o755)
    monkeypatch.setenv("PATH", f"{tmp_path}:/usr/bin:/bin")
    return script


def test_without_cyclictest_it_says_where_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = run_script(TOOL)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == (
        "bench_realtime: cyclictest is not installed; on Debian it is in the package rt-tests\n"
    )


@pytest.mark.parametrize("text", ["0", "20,", "fast"])
def test_rates_are_numbers(text: str) -> None:
    done = run_script(TOOL, "--rates", text)
    assert done.returncode == 2
    assert "is not a whole number from 1 on" in done.stderr


def test_the_percentile_is_the_first_time_that_99_in_100_keep(cyclictest: Path) -> None:
    options = bench.argparse.Namespace(priority=80, cpu=0, seconds=2)
    found = bench.cyclictest(60, options)
    assert (found.p99, found.lost, found.periods) == (pytest.approx(20e-6), 20, 120)


def test_a_cyclictest_that_fails_is_quoted(cyclictest: Path) -> None:
    cyclictest.write_text("#!/bin/sh\necho no permission >&2\nexit 1\n")
    done = run_script(TOOL, "--rounds", "1", "--seconds", "1")
    assert (done.returncode, done.stderr) == (2, "bench_realtime: cyclictest has failed: no permission\n")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")
def test_the_table_has_all_cases(cyclictest: Path) -> None:
    arguments = ("--rates", "50", "--rounds", "1", "--seconds", "1", "--blocks", "3")
    cases = [*bench.CASES, *bench.TUNED_CASES, *bench.READ_CASES]
    found = json.loads(run_script(TOOL, *arguments, "--json", "--writes", "20", "--reader").stdout)
    assert list(found) == ["50"]
    assert list(found["50"]) == ["cyclictest", *cases]
    for (case,) in found["50"].values():
        assert case["p99"] > 0
    assert all(found["50"][name][0]["periods"] == 51 for name in cases)


def test_a_row_of_the_table_is_the_median_of_its_rounds() -> None:
    limit, ours = bench.Measured(20e-6, 0, 50), bench.Measured(30e-6, 1, 51, 5e-6, 9e-6)
    cases = {"cyclictest": [limit, limit], "native": [ours, ours._replace(p99=50e-6)]}
    first, second = bench.rows(50, cases)
    assert first == ("50 Hz", "cyclictest", "20 us", "1.00", "0 of 100", "", "")
    assert second == ("50 Hz", "native", "40 us", "2.00", "2 of 102", "5 us", "9 us")
