"""Sweeps: what is run, what the table says, and that it depends on nothing but the diagram."""

from __future__ import annotations

import csv
import math
import os
import random
import signal
import statistics
import subprocess
import sys
from collections.abc import Iterator, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import quadvis
from quadvis.cli import main
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.files import Claim, Kind
from quadvis.machine.interrupts import ENDS
from quadvis.sweeps import saving
from quadvis.sweeps import sweep as sweeping
from quadvis.sweeps.axes import read_axes
from quadvis.sweeps.designs import make_design
from quadvis.sweeps.picture import draw
from quadvis.sweeps.summary import SweepLine, duration_text, sweep_lines
from quadvis.sweeps.table import read_rows
from quadvis.sweeps.worker import Job, Row, perform
from tests.processes import children, gone, linux, wait_for
from tests.stages import mostly_slow

ROOT = Path(__file__).parents[2]
HUGE = "1e308"  # a factor that makes infinity of the wave

LOOP = """\
quadvis: 1
name: loop
rates: {fast: 20 Hz}
stop_time: 0.95 s
params: {size: 1 m}
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: $size, frequency: 1 Hz}}
  noise: {block: sources.noise, rate: fast, with: {sigma: 1 cm}}
  law: {slot: true, block: signal.gain, rate: fast, in: {u: wave.y}}
variants:
  half: {slots: {law: {block: signal.gain, with: {factor: 0.5}}}}
expect:
  - {signal: law.y, within: 150 cm}
  - {signal: noise.y, rms: 2 cm}
summary:
  law: {signal: law.y, unit: cm}
  noise: {signal: noise.y, show: [rms, final], unit: mm}
"""


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    before = {number: signal.getsignal(number) for number in ENDS}
    (tmp_path / "loop.yaml").write_text(LOOP)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def here(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Do the runs in this process, in an order of their own; return which were done."""
    done: list[int] = []

    def in_turn(jobs: Iterator[Job], workers: int) -> Iterator[Row]:
        taken = list(jobs)
        for job in random.Random(len(taken)).sample(taken, len(taken)):
            done.append(job.index)
            yield perform(job)

    monkeypatch.setattr(sweeping, "perform_all", in_turn)
    return done


def rows_of(path: str) -> list[dict[str, str]]:
    with Path(path).open(newline="") as file:
        return list(csv.DictReader(file))


# axes


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("seed=3", ["3"]),
        ("seed=0..3", ["0", "1", "2", "3"]),
        ("seed=-1..1", ["-1", "0", "1"]),
        ("seed=0..1,7,10..11", ["0", "1", "7", "10", "11"]),
        ("x=0..0.3 step 0.1", ["0", "0.1", "0.2", "0.3"]),
        ("x = 0..10 step 4", ["0", "4", "8"]),
        ("x=1..2 step 0.5 rad/s", ["1 rad/s", "1.5 rad/s", "2 rad/s"]),
        ("x=20 ms..60 ms step 20 ms", ["20 ms", "40 ms", "60 ms"]),
        ("x=20 ms, 0.05 s", ["20 ms", "0.05 s"]),
        ("x=[1, 2],{value: [1, 2], unit: deg}", ["[1, 2]", "{value: [1, 2], unit: deg}"]),
        ("x='a, b',\"c, d\"", ["'a, b'", '"c, d"']),
        ("params=../s0.yaml,a..b/s1.yaml", ["../s0.yaml", "a..b/s1.yaml"]),
        ("variant=none,half", ["none", "half"]),
    ],
)
def test_lists_and_ranges_give_their_values(text: str, values: list[str]) -> None:
    assert list(read_axes([text])[0].values) == values


@given(st.integers(-300, 300), st.integers(0, 60), st.integers(1, 50), st.integers(0, 3))
def test_a_range_is_exact_and_ends_at_or_before_its_end(
    first: int, span: int, step: int, places: int
) -> None:
    scale = Fraction(1, 10**places)
    ends = [f"{float(number * scale):.{places}f}" for number in (first, first + span, step)]
    values = read_axes([f"x={ends[0]}..{ends[1]} step {ends[2]}"])[0].values
    wanted = [scale * (first + step * index) for index in range(span // step + 1)]
    assert [Fraction(value) for value in values] == wanted


@given(st.lists(st.lists(st.integers(-9, 9), min_size=1, max_size=3), min_size=1, max_size=4, unique_by=str))
def test_commas_inside_a_list_do_not_divide_the_values(values: list[list[int]]) -> None:
    text = ",".join(map(str, values))
    assert list(read_axes([f"x={text}"])[0].values) == [str(value) for value in values]
    assert list(read_axes({"x": values})[0].values) == [str(value) for value in values]


@pytest.mark.parametrize(
    ("values", "column", "cells"),
    [
        ("20 ms,0.05 s", "x [ms]", [20.0, 50.0]),
        ("0.5..1 step 0.5 rad/s", "x [rad/s]", [0.5, 1.0]),
        ("1,2", "x", [1, 2]),
        ("1,2.5", "x", [1.0, 2.5]),
        ("1 m,1 rad", "x", ["1 m", "1 rad"]),
        ("paper,rigid_body", "x", ["paper", "rigid_body"]),
    ],
)
def test_an_axis_of_quantities_is_a_column_of_numbers_with_the_unit_in_its_name(
    values: str, column: str, cells: list[Any]
) -> None:
    axis = read_axes([f"x={values}"])[0]
    assert axis.column == column
    found = axis.cells(range(len(cells))).tolist()
    assert found == cells
    assert [type(value) for value in found] == [type(value) for value in cells]


def test_all_combinations_are_run_with_the_last_axis_fastest() -> None:
    grid = make_design(read_axes(["a=1,2", "b=5..7"]), "grid", None, 0)
    assert grid.places(range(grid.runs)).tolist() == [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [1, 2]]


BAD = [
    "seed", "=1", "seed=", "seed=1,,2", "seed=1,1", "seed=5..1", "seed=a..b", "seed=1.5", "seed=1e3",
    "size=0..1.5", "size=1 m..2 s step 1", "size=1..2 step 0", "size=1..2 step -1", "size=0..1e12",
    "size=1e999999999..2", "seed=0..999 step 0.001", "size=1 x,2 x", "sise=1 m,2 m", "law.fctor=1,2",
    "law.factor=[1],[2]", "variant=none,quarter", "params=none,missing.yaml", "size=1..3 m",
]  # fmt: skip


@pytest.mark.parametrize("text", BAD)
def test_what_cannot_be_swept_over_is_told_in_one_sentence(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", "loop.yaml", "--over", text, "-o", "x.csv"]) == 2
    told = capsys.readouterr()
    assert not told.out
    assert told.err.count("\n") == 1
    assert len(told.err) < 200
    assert not Path("x.csv").exists()


@pytest.mark.parametrize(
    "arguments",
    [
        (),
        ("--over", "seed=1,2", "--seed", "3"),
        ("--over", "size=1 m,2 m", "--set", "size=3 m"),
        ("--over", "seed=1", "--over", "seed=2"),
        ("--over", "seed=1", "--variant", "half", "--variant", "half"),
        ("--over", "variant=none,half", "--variant", "half"),
        ("--over", "seed=1..4000", "--over", "size=1..400 step 1 m"),
        ("--over", "seed=1..400", "--over", "size=1..400 step 1 m", "-o", "x.csv"),
        ("--over", "seed=1", "--workers", "0"),
        ("--over", "seed=1", "-o", "x.txt"),
        ("--over", "seed=1", "-o", "none/x.csv"),
        ("--over", "seed=1", "-o", "."),
        ("--over", "seed=1", "--plot", "x.pdf"),
        ("--over", "seed=1", "--plot", "none/x.png"),
        ("--over", "seed=1", "--logs", "loop.yaml"),
        ("--over", "seed=1", "--stop-time", "5"),
    ],
)
def test_what_does_not_go_together_is_told_before_anything_runs(
    arguments: tuple[str, ...], here: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", "loop.yaml", *arguments]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert here == []


# the table


def test_the_numbers_are_those_of_closed_forms_in_the_units_of_the_columns(here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", {"size": ["1 m", "50 cm"], "law.factor": [1, 3]})
    assert repr(table) == f"<Table of loop: 4 runs, {len(table)} columns>"
    size, factor = np.array([1.0, 1.0, 0.5, 0.5]), np.array([1, 3, 1, 3])
    np.testing.assert_array_equal(table["size [m]"], size)
    np.testing.assert_array_equal(table["law.factor"], factor)
    # Twenty samples of one period: the RMS of a sine is its amplitude over the root of two.
    np.testing.assert_allclose(table["law.rms [cm]"], 100 * size * factor / math.sqrt(2))
    np.testing.assert_allclose(table["law.max [cm]"], 100 * size * factor)
    np.testing.assert_allclose(table["law.y within 150 cm [cm]"], 100 * size * factor)
    assert table["passed"].tolist() == [True, False, True, True]
    assert not table.passed
    assert set(table["failure"]) == {""}
    assert {name: column.dtype.kind for name, column in table.items() if "[" not in name} == {
        "law.factor": "i", "passed": "b", "failure": "U", "hash": "U",
    }  # fmt: skip


def test_each_row_is_the_run_of_its_seed_alone(here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", ["seed=7..9", "variant=none,half"])
    assert table["seed"].tolist() == [7, 7, 8, 8, 9, 9]
    assert table["variant"].tolist() == ["none", "half"] * 3
    for row in range(table.runs):
        variant = "half" if table["variant"][row] == "half" else None
        result = quadvis.load("loop.yaml", variant=variant, seed=int(table["seed"][row])).run()
        noise = result["noise.y"]
        assert table["hash"][row] == result.diagram.hash
        assert table["noise.rms [mm]"][row] == pytest.approx(1000 * np.sqrt(np.mean(noise**2)), rel=1e-12)
        assert table["noise.final [mm]"][row] == pytest.approx(1000 * noise[-1], rel=1e-12)
        assert table["law.max [cm]"][row] == pytest.approx(50 if variant else 100)


def test_parameter_files_are_an_axis_and_a_base(here: list[int]) -> None:
    Path("a.yaml").write_text("{quadvis: 1, name: A, set: {size: 2 m}}")
    Path("b.yaml").write_text("{quadvis: 1, name: B, set: {law.factor: 4}}")
    table = quadvis.sweep("loop.yaml", {"params": ["b.yaml", None, Path("a.yaml")]}, params="a.yaml")
    assert table["params"].tolist() == ["b.yaml", "none", "a.yaml"]
    np.testing.assert_allclose(table["law.max [cm]"], [800, 200, 200])
    table = quadvis.sweep("loop.yaml", ["size=3 m,4 m"], params="a.yaml", settings={"law.factor": 10})
    np.testing.assert_allclose(table["law.max [cm]"], [3000, 4000])


def test_a_run_that_stops_is_a_row_that_says_why(here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", {"size": ["1 m", "9e9 m"], "law.factor": ["1", HUGE]}, output="x.csv")
    assert table["passed"].tolist() == [True, False, False, False]
    failures = table["failure"].tolist()
    assert [bool(failure) for failure in failures] == [False, False, False, True]
    with pytest.raises(RunError) as error:
        quadvis.load("loop.yaml", settings={"size": "9e9 m", "law.factor": HUGE}).run()
    assert failures[3] == str(error.value)
    assert math.isnan(table["law.rms [cm]"][3])
    assert [row["law.rms [cm]"] == "" for row in rows_of("x.csv")] == [False, False, False, True]


def test_a_combination_that_does_not_load_is_a_row_as_well(here: list[int]) -> None:
    Path("limits.yaml").write_text(
        "{quadvis: 1, name: limits, rates: {fast: 10 Hz}, stop_time: 1 s, blocks: {"
        "wave: {block: sources.sine, rate: fast, with: {amplitude: 1 m}},"
        "law: {block: signal.saturation, rate: fast, in: {u: wave.y},"
        "with: {lower: -1 m, upper: 9 m}}}, summary: {y: law.y}}"
    )
    table = quadvis.sweep("limits.yaml", {"law.lower": ["-1 m", "5 m"], "law.upper": ["9 m", "2 m"]})
    assert [bool(failure) for failure in table["failure"]] == [False, False, False, True]
    assert "law" in table["failure"][3]


def test_what_is_wrong_in_the_middle_of_a_long_axis_is_a_row_and_at_its_ends_a_fault(here: list[int]) -> None:
    values = [f"{number} mm" for number in range(120)]
    table = quadvis.sweep("loop.yaml", {"noise.sigma": [*values[:60], "-1 mm", *values[60:]]})
    assert [row for row, failure in enumerate(table["failure"]) if failure] == [60]
    assert (
        table["failure"][60].startswith("settings: ") and "sigma must be at least 0" in table["failure"][60]
    )
    for wrong in ([*values, "-1 mm"], ["-1 mm", *values], [values[0], "-1 mm", *values[1:]]):
        with pytest.raises(QuadvisError, match=r"^over noise.sigma=-1 mm: .* at least 0"):
            quadvis.sweep("loop.yaml", {"noise.sigma": wrong})


def test_numbers_of_another_unit_never_stand_in_one_column(here: list[int]) -> None:
    Path("open.yaml").write_text(
        "{quadvis: 1, name: open, rates: {fast: 10 Hz}, stop_time: 1 s, summary: {y: wave.y}, blocks: {"
        "wave: {block: sources.sine, rate: fast, with: {amplitude: 1 m}}}}"
    )
    table = quadvis.sweep("open.yaml", {"wave.amplitude": ["1 m", "2 rad", "300 cm"]})
    assert table["y.max [m]"][[0, 2]] == pytest.approx([0.951, 2.853], abs=1e-3)
    assert math.isnan(table["y.max [m]"][1])
    assert "other units" in table["failure"][1]


def test_csv_reads_back_to_the_same_bits(here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", ["seed=0..4", "size=0.1..0.3 step 0.1 m"], output="x.csv")
    read = rows_of("x.csv")
    assert list(read[0]) == list(table)
    for name, column in table.items():
        cells = [row[name] for row in read]
        if column.dtype.kind == "f":
            assert [float(cell) for cell in cells] == column.tolist()
        else:
            assert cells == [str(value).lower() if name == "passed" else str(value) for value in column]


def test_parquet_reads_back_to_the_same_bits(here: list[int]) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = quadvis.sweep("loop.yaml", ["seed=0..2", "size=1 m,9e9 m"], output="x.parquet")
    read = parquet.read_table("x.parquet")
    assert read.column_names == list(table)
    for name, column in table.items():
        np.testing.assert_array_equal(np.array(read[name].to_pylist()), column)


def test_without_pyarrow_a_parquet_table_is_refused_with_what_to_install(
    here: list[int], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    assert main(["sweep", "loop.yaml", "--over", "seed=1", "-o", "x.parquet"]) == 2
    told = capsys.readouterr().err
    assert "pip install 'quadvis[parquet]'" in told
    assert told.count("\n") == 1
    assert here == []


def test_wall_times_stand_in_the_table_only_if_they_are_wanted(here: list[int]) -> None:
    quadvis.sweep("loop.yaml", ["seed=0..1"], output="x.csv", timings=True)
    assert all(float(row["wall [s]"]) > 0 for row in rows_of("x.csv"))
    table = quadvis.sweep("loop.yaml", ["seed=0..1"], output="x.csv")
    assert "wall [s]" not in rows_of("x.csv")[0]
    assert (table.wall > 0).all()


def test_logs_are_written_where_they_are_wanted(here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", ["size=1 m,2 m", "seed=5..6"], logs="logs")
    names = sorted(path.name for path in Path("logs").iterdir())
    assert names == [
        "0-size=1-m-seed=5.mcap", "1-size=1-m-seed=6.mcap",
        "2-size=2-m-seed=5.mcap", "3-size=2-m-seed=6.mcap",
    ]  # fmt: skip
    assert [quadvis.read_log(f"logs/{name}").metadata["hash"] for name in names] == table["hash"].tolist()


# resuming


def test_a_resumed_sweep_runs_only_what_is_missing_and_gives_the_same_bytes(here: list[int]) -> None:
    over = ["size=1 m,2 m", "seed=0..4"]
    quadvis.sweep("loop.yaml", over, output="whole.csv")
    whole = Path("whole.csv").read_text()
    lines = whole.splitlines(keepends=True)
    Path("part.csv").write_text("".join([lines[0], lines[9], lines[2], lines[5]]))
    here.clear()
    quadvis.sweep("loop.yaml", over, output="part.csv", resume=True)
    assert sorted(here) == [0, 2, 3, 5, 6, 7, 9]
    assert Path("part.csv").read_text() == whole
    here.clear()
    quadvis.sweep("loop.yaml", over, output="part.csv", resume=True)
    assert here == []
    assert Path("part.csv").read_text() == whole


def test_a_resumed_sweep_may_be_larger_and_of_another_kind_of_file(here: list[int]) -> None:
    pytest.importorskip("pyarrow")
    quadvis.sweep("loop.yaml", ["seed=0..3"], output="x.parquet")
    here.clear()
    table = quadvis.sweep("loop.yaml", ["size=1 m,2 m", "seed=2..5"], output="x.parquet", resume=True)
    assert sorted(here) == [2, 3, 4, 5, 6, 7]
    again = quadvis.sweep("loop.yaml", ["size=1 m,2 m", "seed=2..5"])
    assert all((table[name] == again[name]).all() for name in table)


def test_what_was_changed_or_stopped_is_run_again(here: list[int]) -> None:
    over = {"size": ["1 m", "9e9 m"], "law.factor": [1, HUGE]}
    quadvis.sweep("loop.yaml", over, output="x.csv")
    here.clear()
    quadvis.sweep("loop.yaml", over, output="x.csv", resume=True)
    assert here == [3]
    here.clear()
    quadvis.sweep("loop.yaml", over, output="x.csv", resume=True, stop_time="0.9 s")
    assert sorted(here) == [0, 1, 2, 3]


@pytest.mark.parametrize("contents", [b"", b"a,b\n1,2\n", b"\xff\xfe", b'passed,hash\n"1'])
def test_a_file_that_is_no_table_is_not_gone_on_with(
    contents: bytes, here: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    Path("x.csv").write_bytes(contents)
    code = main(["sweep", "loop.yaml", "--over", "seed=1", "-o", "x.csv", "--resume", "--plot", ""])
    if contents:
        assert code == 2
        assert capsys.readouterr().err.count("\n") == 1
        assert Path("x.csv").read_bytes() == contents
    else:
        assert code == 0


# what people see


def test_the_summary_has_the_mean_and_the_range_over_the_seeds(
    here: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sweep", "loop.yaml", "--over", "size=1 m,2 m", "--over", "seed=0..20"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "loop: 42 runs, 21 seeds at 2 points"
    assert lines[-3:] == [
        "FAILED: 21 of 42 runs passed", "table: runs/loop-sweep.csv", "plot: runs/loop-sweep.png",
    ]  # fmt: skip
    noise = [float(row["noise.rms [mm]"]) for row in rows_of("runs/loop-sweep.csv")][:21]
    twentieths = statistics.quantiles(noise, n=20, method="inclusive")
    spread = f"{statistics.mean(noise):.4g} ({twentieths[0]:.3g} to {twentieths[-1]:.3g})"
    assert any(line.startswith("  1 m ") and spread in line for line in lines)
    assert sum("21 of 21" in line for line in lines) == sum("0 of 21" in line for line in lines) == 1


def test_the_columns_of_the_summary_are_as_wide_as_the_terminal(here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", ["size=1 m,2 m", "seed=0..3"])
    for width in (60, 80, 200):
        assert max(map(len, sweep_lines(table, width))) <= width
    assert len(sweep_lines(table, 60)) > len(sweep_lines(table, 200))


def test_the_summary_says_why_runs_stopped(here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", {"size": ["9e9 m"], "law.factor": [HUGE], "seed": range(3)})
    lines = sweep_lines(table)
    assert sum("stopped: size=9e9 m" in line and "(and 2 more): block 'law'" in line for line in lines) == 1
    assert lines[-1] == "FAILED: 0 of 3 runs passed"


PICTURES: list[dict[str, Any]] = [
    {"seed": range(5)},
    {"size": ["1 m", "2 m"], "seed": range(3)},
    {"size": "0.1..3 step 0.1 m", "law.factor": [1, 2, 3]},
    {"variant": [None, "half"], "size": ["1 m", "2 m"], "law.factor": [1, 2], "seed": [1, 2]},
    {"size": ["9e9 m"], "law.factor": [HUGE]},
]


@pytest.mark.parametrize("over", mostly_slow(PICTURES, 2), ids=lambda over: "-".join(over))
def test_the_picture_is_a_png_whatever_is_swept_over(over: dict[str, Any], here: list[int]) -> None:
    table = quadvis.sweep("loop.yaml", over)
    draw(table, Path("x.png"))
    assert Path("x.png").read_bytes().startswith(b"\x89PNG")
    with pytest.raises(QuadvisError, match="cannot write the plot"):
        draw(table, Path("none/x.png"))


def test_the_progress_is_told_to_those_who_ask(here: list[int]) -> None:
    told: list[tuple[int, int, int]] = []
    quadvis.sweep("loop.yaml", ["size=1 m,2 m"], progress=lambda *numbers: told.append(numbers))
    assert [numbers[:2] for numbers in told] == [(1, 2), (2, 2)]
    assert told[-1][2] == 1


def test_the_line_of_progress_is_rewritten_and_goes_away(capsys: pytest.CaptureFixture[str]) -> None:
    with SweepLine() as line:
        line.shown = True
        line(3, 12, 0)
        line(6, 12, 2)
    told = capsys.readouterr().err
    assert "[######..................] 3 / 12 runs" in told
    assert "[############............] 6 / 12 runs  2 failed" in told
    assert told.endswith("\r\x1b[K")
    assert "\n" not in told
    assert [duration_text(seconds) for seconds in (5, 300, 9000)] == ["5 s", "5 min", "2.5 h"]


# processes


def quadvis_sweep(
    *arguments: str, command: Sequence[str] = ("-m", "quadvis", "sweep")
) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(map(str, (ROOT, ROOT / "blocks")))}
    return subprocess.Popen(
        [sys.executable, *command, *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=environment, start_new_session=True,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("kind", "workers"), mostly_slow([("csv", "3"), ("csv", "1"), ("parquet", "1"), ("parquet", "3")])
)
def test_the_table_is_the_same_to_the_bit_for_any_number_of_workers(
    kind: str, workers: str, here: list[int]
) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    over = ["law.factor=1,1e308", "size=1 m,9e9 m", "seed=0..3"]
    quadvis.sweep("loop.yaml", over, output=f"here.{kind}")
    process = quadvis_sweep(
        "loop.yaml", *(f"--over={text}" for text in over), "--workers", workers, "-o", f"there.{kind}"
    )
    _, told = process.communicate(timeout=120)
    assert (process.returncode, told) == (1, "")
    assert Path(f"here.{kind}").read_bytes() == Path(f"there.{kind}").read_bytes()


@pytest.mark.slow
def test_a_script_needs_no_guard_and_its_environment_is_left_alone() -> None:
    Path("script.py").write_text(
        "import os, quadvis\n"
        "before = dict(os.environ)\n"
        "print('once', quadvis.sweep('loop.yaml', {'seed': range(2)}, workers=2).passed)\n"
        "assert before == dict(os.environ)\n"
    )
    process = quadvis_sweep("script.py", command=())
    out, told = process.communicate(timeout=120)
    assert (process.returncode, out, told) == (0, "once True\n", "")


def test_a_worker_has_one_thread_for_each_library(monkeypatch: pytest.MonkeyPatch) -> None:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    import cv2

    from quadvis.machine.processes import launching

    monkeypatch.setenv("OPENCV_FOR_THREADS_NUM", "2")
    with ProcessPoolExecutor(1, get_context("spawn")) as executor:
        with launching():
            threads = executor.submit(cv2.getNumThreads)
        assert threads.result() == 1


RUNS = 30  # many: the sweep must not be through before the signal of the test arrives
INTERRUPTED = f"interrupted\n{{}} of {RUNS} runs are finished and in x.csv; --resume does the rest\n"


def long_runs(seconds: int) -> None:
    Path("long.yaml").write_text(LOOP.replace("0.95 s", f"{seconds} s"))


@linux
@pytest.mark.parametrize(
    ("number", "code", "words"),
    mostly_slow([(signal.SIGINT, 130, INTERRUPTED), (signal.SIGHUP, 129, ""), (signal.SIGTERM, 143, "")]),
)  # fmt: skip
def test_what_is_finished_when_a_sweep_is_ended_stays_and_resuming_gives_the_bytes_of_one_go(
    number: signal.Signals, code: int, words: str, here: list[int]
) -> None:
    long_runs(150)
    arguments = ("long.yaml", "--over", f"seed=0..{RUNS - 1}", "--workers", "2")
    process = quadvis_sweep(*arguments, "-o", "x.csv", "--logs", "logs")
    workers = wait_for(lambda: children(process))
    wait_for(lambda: len(list(Path("logs").glob("*"))) >= 6)  # four are finished, if not yet all told
    os.killpg(process.pid, number)
    out, told = process.communicate(timeout=60)
    assert (process.returncode, out) == (code, "")
    count = len(rows_of("x.csv"))
    assert 1 <= count < RUNS
    assert told == words.format(count)
    assert all(wait_for(lambda pid=pid: gone(pid)) for pid in workers)
    assert [path.name for path in Path().glob(".*")] == []
    for name in ("x.csv", "y.csv"):
        quadvis.sweep("long.yaml", {"seed": range(RUNS)}, output=name, resume=True)
    assert len(here) == RUNS - count + RUNS
    assert Path("x.csv").read_bytes() == Path("y.csv").read_bytes()


@pytest.mark.slow
@linux
def test_a_worker_that_is_killed_is_told_in_one_sentence() -> None:
    long_runs(100_000)
    process = quadvis_sweep(
        "long.yaml", "--over", "seed=0..9", "--workers", "2", "-o", "x.csv", "--engine", "python"
    )
    workers = wait_for(lambda: len(children(process)) == 2 and children(process))
    os.kill(workers[0], signal.SIGKILL)
    _, told = process.communicate(timeout=60)
    assert process.returncode == 1
    assert told.splitlines() == [
        "a worker process was killed, perhaps by the system for lack of memory; try fewer workers",
        "0 of 10 runs are finished",
    ]
    assert all(wait_for(lambda pid=pid: gone(pid)) for pid in workers)


@pytest.mark.slow
@linux
def test_workers_end_with_the_first_process_however_it_ends() -> None:
    long_runs(100_000)
    arguments = ("--over", "seed=0..9", "--workers", "2", "-o", "x.csv", "--logs", "logs")
    process = quadvis_sweep("long.yaml", *arguments)
    workers = wait_for(lambda: len(children(process)) == 2 and children(process))
    wait_for(lambda: len(list(Path("logs").glob("*"))) == 2)  # both have begun
    process.kill()
    process.communicate(timeout=60)
    assert all(wait_for(lambda pid=pid: gone(pid)) for pid in workers)


def test_what_is_finished_is_written_now_and_then(here: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(saving, "SAVE", 0.0)
    monkeypatch.setattr(saving, "SHARE", 0)
    seen: list[int] = []
    quadvis.sweep(
        "loop.yaml", ["seed=0..3"], output="x.csv", progress=lambda *_: seen.append(len(rows_of("x.csv")))
    )
    assert seen == [0, 1, 2, 3]
    assert [row["seed"] for row in rows_of("x.csv")] == ["0", "1", "2", "3"]


HANGS = """\
import time

from quadvis.block import Block, In, Param


class Hang(Block, numeric=False):
    \"""Lets a run with a large wave never end.\"""

    u = In(unit="a")
    most = Param(2.0, doc="what is large")

    def update(self, u):
        \"""Look at the wave.\"""
        while abs(u) > self.most:
            time.sleep(0.1)
"""


def hanging_runs() -> tuple[str, ...]:
    """Return a sweep of which some runs never end."""
    Path("blocks/own").mkdir(parents=True)
    Path("blocks/own/hang.py").write_text(HANGS)
    hang = "  hang: {block: own.hang, rate: fast, in: {u: wave.y}}\nvariants:"
    Path("hang.yaml").write_text(LOOP.replace("variants:", hang))
    return ("hang.yaml", "--over", "seed=0..2", "--over", "size=1 m,9 m", "--workers", "2")


@linux
@pytest.mark.parametrize("kind", mostly_slow(["csv", "parquet"]))
def test_rows_are_in_the_table_also_if_no_other_run_ends_and_the_sweep_is_killed(
    kind: str, here: list[int]
) -> None:
    if kind == "parquet":
        pytest.importorskip("pyarrow")
    arguments = (*hanging_runs(), "--over", "law.factor=1,2", "-o", f"x.{kind}")
    process = quadvis_sweep(*arguments)
    name = Path(f"x.{kind}")

    def written() -> list[dict[str, Any]]:
        return read_rows(name) if name.is_file() and name.stat().st_size else []

    found = wait_for(written)
    process.kill()
    process.communicate(timeout=60)
    assert {row["size [m]"] for row in found} <= {"1.0", 1.0}
    assert all(row["hash"] for row in found)
    table = quadvis.sweep("loop.yaml", ["seed=0..1", "size=1 m,9 m"], output=f"y.{kind}", resume=True)
    assert table.runs == 4


def test_two_sweeps_never_write_one_table(here: list[int], capsys: pytest.CaptureFixture[str]) -> None:
    kind = Kind("the table")
    quadvis.sweep("loop.yaml", ["seed=0..1"], output="x.csv")
    before = Path("x.csv").read_bytes()
    held = Claim("x.csv", kind)
    assert main(["sweep", "loop.yaml", "--over", "seed=0..4", "-o", "x.csv", "--plot", ""]) == 2
    assert "another run is writing it" in capsys.readouterr().err
    assert Path("x.csv").read_bytes() == before
    held.close()


@pytest.mark.parametrize("option", ["-o", "--plot"])
def test_a_sweep_writes_over_nothing_that_it_reads_and_no_file_of_another_kind(
    option: str, here: list[int], capsys: pytest.CaptureFixture[str]
) -> None:
    suffix = ".png" if option == "--plot" else ".csv"
    Path("set.yaml").write_text("quadvis: 1\nname: s\nset: {size: 2 m}\n")
    for source in ("loop.yaml", "set.yaml", "other.txt"):
        Path("other.txt").write_text("notes")
        out = Path(f"out{suffix}")
        out.hardlink_to(source)
        before = Path(source).read_bytes()
        options = ["--params", "set.yaml", "--over", "seed=0", option, str(out)]
        assert main(["sweep", "loop.yaml", *options]) == 2
        told = capsys.readouterr().err
        assert told.count("\n") == 1
        assert ("input" in told) == (source != "other.txt")
        assert Path(source).read_bytes() == out.read_bytes() == before
        out.unlink()
    assert here == []


@pytest.mark.slow
def test_the_final_value_of_a_vector_has_a_column_for_each_element(here: list[int]) -> None:
    text = LOOP.replace("summary:\n", (
        "summary:\n  all: {signal: both.y, show: [rms, final], unit: cm}\n"
        '  last: {signal: "both.y[1:3]", show: [final]}\n  one: {signal: "both.y[1]", show: [final]}\n'
    ))  # fmt: skip
    both = "  both: {block: signal.concatenate, rate: fast, in: {u: [wave.y, law.y, noise.y]}}\n"
    Path("loop.yaml").write_text(text.replace("variants:\n", f"{both}variants:\n"))
    over = {"size": ["1 m", "2 m"], "seed": range(2)}
    table = quadvis.sweep("loop.yaml", over, output="x.csv")
    finals = [name for name in table if ".final" in name and name[:3] in ("all", "las", "one")]
    assert finals == [
        "all.final[0] [cm]", "all.final[1] [cm]", "all.final[2] [cm]",
        "last.final[1] [m]", "last.final[2] [m]", "one.final [m]",
    ]  # fmt: skip
    for row, (size, seed) in enumerate((size, seed) for size in ("1 m", "2 m") for seed in range(2)):
        last = quadvis.load("loop.yaml", settings={"size": size}, seed=seed).run()["both.y"][-1]
        found = [table[name][row] for name in finals]
        assert found == pytest.approx([*(last * 100), *last[1:], last[1]])
    lines = "\n".join(sweep_lines(table))
    assert "all.final[2] [cm]" in lines
    here.clear()
    again = quadvis.sweep("loop.yaml", over, output="x.csv", resume=True)
    assert here == []
    assert all(np.array_equal(again[name], table[name]) for name in finals)
    draw(table, Path("x.png"))
    assert Path("x.png").stat().st_size > 0


def test_a_run_that_has_not_all_of_a_window_is_a_row_that_does_not_pass(here: list[int]) -> None:
    Path("loop.yaml").write_text(LOOP.replace("within: 150 cm", "before: 0.9 s, within: 10 m"))
    assert quadvis.sweep("loop.yaml", {"seed": range(2)}).passed
    assert not quadvis.sweep("loop.yaml", {"seed": range(2)}, stop_time="0.5 s")["passed"].any()


@pytest.mark.parametrize(
    ("option", "design", "runs"),
    [("plot", "grid", None), ("plot", "random", 3), ("sensitivity", "random", 100)],
)
def test_a_picture_of_runs_without_numbers_is_refused_before_they_run(
    tmp_path: Path, option: str, design: str, runs: int | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "loop.yaml"
    path.write_text(LOOP.partition("expect:")[0])
    monkeypatch.setattr(sweeping, "_performed", lambda *_: pytest.fail("it has begun to run"))
    picture: dict[str, Any] = {option: tmp_path / "sweep.png"}
    with pytest.raises(QuadvisError, match="neither 'summary' nor 'expect'"):
        quadvis.sweep(path, {"size": ["1 m", "2 m", "3 m"]}, design=design, runs=runs, **picture)
