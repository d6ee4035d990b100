"""Signals of a log for other programs: tables, frames and files, read back by those programs."""

from __future__ import annotations

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.api import load_text
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.output.log_reader import Log, read_log
from quadvis.output.recording import RecordedBlock, RecordedPort, Recording
from quadvis.output.tables import signal_table

Captured = pytest.CaptureFixture[str]
DIAGRAM = """
quadvis: 1
name: several
rates: {slow: {rate: 300 ms, offset: 100 ms}, fast: 10 Hz}
solver: {method: ode4, step: 100 ms}
stop_time: 1 s
blocks:
  ramp: {block: sources.ramp, rate: slow, with: {slope: 1 m/s}}
  line: {block: signal.integrator, in: {u: 2 m/s}}
  high:
    block: logic.compare
    rate: fast
    with: {operator: ">"}
    in: {a: {from: ramp.y, across: hold}, b: 0.5 m}
  both:
    block: signal.concatenate
    rate: fast
    in: {u: [{from: ramp.y, across: hold}, {from: line.y, across: sample}]}
"""


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "several.mcap"
    load_text(DIAGRAM).run(log=path)
    return path


@pytest.fixture(scope="module")
def log(path: Path) -> Log:
    return read_log(path)


def recording(*stamps: list[int], rates: tuple[str, ...] = ("a", "b", "c")) -> Recording:
    """Return one float64 signal for each list of stamps (ns), whose values are these stamps."""
    blocks = [
        RecordedBlock(f"/x{n}", (RecordedPort("y"),), rate)
        for n, rate in zip(range(len(stamps)), rates, strict=False)
    ]
    made = Recording(blocks)
    for number, each in enumerate(stamps):
        values = np.array(each, np.float64)
        made.extend(number, np.array(each, np.int64), values.view(np.int64).reshape(-1, 1))
    return made


def test_a_table_has_a_row_for_each_time_and_holds_what_is_sampled(log: Log) -> None:
    table = signal_table(log, ["ramp.y", "line.y", "high.y"])
    np.testing.assert_allclose(table.times, np.arange(11) / 10, atol=1e-12)
    ramp, line, high = table.columns
    assert [each.unit for each in table.columns] == ["m", "m", ""]
    expected = [math.nan, 0.1, 0.1, 0.1, 0.4, 0.4, 0.4, 0.7, 0.7, 0.7, 1.0]
    np.testing.assert_allclose(ramp.values, expected, atol=1e-12)
    np.testing.assert_allclose(line.values, 0.2 * np.arange(11), atol=1e-12)
    assert high.values.dtype == bool and high.values.tolist() == [False] * 7 + [True] * 4


def test_rows_of_one_distance_and_straight_lines_of_what_is_continuous(log: Log) -> None:
    table = signal_table(log, ["ramp.y", "line.y"], every="250 ms")
    np.testing.assert_allclose(table.times, [0, 0.25, 0.5, 0.75, 1.0])
    np.testing.assert_allclose(table.columns[1].values, [0, 0.5, 1.0, 1.5, 2.0], atol=1e-12)
    np.testing.assert_allclose(table.columns[0].values, [math.nan, 0.1, 0.4, 0.7, 1.0], atol=1e-12)
    assert len(signal_table(log, ["line.y"], every=0.25).stamps) == 5


def test_the_signals_of_a_rate_are_a_table_of_their_own(log: Log) -> None:
    table = signal_table(log, rate="slow")
    assert [each.name for each in table.columns] == ["ramp.y"]
    np.testing.assert_allclose(table.times, [0.1, 0.4, 0.7, 1.0])


@given(
    st.lists(st.integers(0, 50), unique=True).map(sorted),
    st.lists(st.integers(0, 50), min_size=1, unique=True).map(sorted),
)
def test_each_value_is_the_newest_one_up_to_its_time(first: list[int], second: list[int]) -> None:
    table = signal_table(recording(first, second))
    assert table.stamps.tolist() == sorted({*first, *second})
    for column, own in zip(table.columns, (first, second), strict=True):
        for stamp, value in zip(table.stamps.tolist(), column.values.tolist(), strict=True):
            past = [each for each in own if each <= stamp]
            assert value == past[-1] if past else math.isnan(value)


@given(
    st.lists(st.integers(0, 50), min_size=1, unique=True).map(sorted),
    st.lists(st.integers(0, 50), min_size=1, unique=True).map(sorted),
)
def test_what_is_continuous_moves_in_straight_lines_and_ends_level(
    first: list[int], second: list[int]
) -> None:
    table = signal_table(recording(first, second, rates=("continuous", "b")))
    for stamp, value in zip(table.stamps.tolist(), table.columns[0].values.tolist(), strict=True):
        expected = math.nan if stamp < first[0] else min(stamp, first[-1])
        assert value == pytest.approx(expected, nan_ok=True)


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        ({"signals": ["ramp.z"]}, "there is no signal 'ramp.z'; did you mean 'ramp.y'?"),
        ({"rate": "slwo"}, "no signal has the rate 'slwo'; did you mean 'slow'?"),
        ({"every": "0 s"}, "the distance of rows is '0 s'; it must be above 0 s"),
        ({"every": "10 m"}, "'10 m'"),
        ({"every": "1 ns"}, "too long"),
    ],
)
def test_what_is_wrong_gets_a_sentence(log: Log, options: dict[str, Any], sentence: str) -> None:
    with pytest.raises(QuadvisError) as caught:
        signal_table(log, **options)
    assert sentence in str(caught.value)


def test_elements_have_the_names_that_a_diagram_gives_them(log: Log) -> None:
    names = [each.name for each in signal_table(log, ["both.y", "both.y[1]", "both.y[0:2]"]).columns]
    assert names == ["both.y[0]", "both.y[1]", "both.y[1]", "both.y[0]", "both.y[1]"]


def test_a_frame_of_pandas(log: Log) -> None:
    pandas = pytest.importorskip("pandas")
    frame = log.frame(["ramp.y", "both.y"], every="500 ms")
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame.columns) == ["ramp.y", "both.y[0]", "both.y[1]"]
    assert frame.index.name == "time" and list(frame.index) == [0.0, 0.5, 1.0]
    assert frame.attrs["units"] == {"ramp.y": "m", "both.y[0]": "m", "both.y[1]": "m"}
    assert frame["both.y[1]"].iloc[-1] == pytest.approx(2.0)
    result = load_text(DIAGRAM).run()
    pandas.testing.assert_frame_equal(result.frame(), log.frame())


def test_a_dataset_of_xarray(log: Log) -> None:
    xarray = pytest.importorskip("xarray")
    data = log.xarray()
    assert isinstance(data, xarray.Dataset)
    assert data["both.y"].dims == ("time", "both.y[0]") and data["both.y"].shape == (11, 2)
    assert data["ramp.y"].dims == ("time_slow",)
    assert data["ramp.y"].attrs == {"units": "m"}
    np.testing.assert_array_equal(data["ramp.y"], log["ramp.y"])
    np.testing.assert_allclose(data["time_slow"], [0.1, 0.4, 0.7, 1.0])


def test_a_package_that_is_missing_gets_a_sentence(log: Log, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(QuadvisError, match=r"this needs the package pandas; install 'quadvis\[frames\]'"):
        log.frame()


def exported(path: Path, folder: Path, suffix: str, *words: str) -> Path:
    output = folder / f"out{suffix}"
    assert main(["export", str(path), "-o", str(output), *words]) == 0
    return output


def test_csv_reads_back_to_the_bit(path: Path, log: Log, tmp_path: Path) -> None:
    file = exported(path, tmp_path, ".csv")
    head, *rows = csv.reader(file.read_text().splitlines())
    assert head == ["time (s)", "ramp.y (m)", "line.y (m)", "high.y", "both.y[0] (m)", "both.y[1] (m)"]
    table = signal_table(log)
    for number, column in enumerate(table.columns, 1):
        values = [float(row[number]) if row[number] else math.nan for row in rows]
        np.testing.assert_array_equal(values, column.values.astype(float))
    assert [row[0] for row in rows[:4]] == ["0", "0.1", "0.2", "0.3"]


def test_pandas_reads_the_csv(path: Path, tmp_path: Path) -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.read_csv(exported(path, tmp_path, ".csv", "--rate", "fast"))
    assert list(frame.columns) == ["time (s)", "high.y", "both.y[0] (m)", "both.y[1] (m)"]
    assert frame["high.y"].tolist() == [0] * 7 + [1] * 4


def test_parquet_has_types_and_units(path: Path, log: Log, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(exported(path, tmp_path, ".parquet", "--signals", "high.y, both.y[1]"))
    assert table.column_names == ["time", "high.y", "both.y[1]"]
    assert table.schema.field("both.y[1]").metadata == {b"unit": b"m"}
    assert table["high.y"].to_pylist() == log["high.y"].tolist()


def test_numpy_reads_each_signal_with_its_own_times(path: Path, log: Log, tmp_path: Path) -> None:
    with np.load(exported(path, tmp_path, ".npz")) as arrays:
        assert set(arrays) == {part for name in log.names for part in (name, f"{name}.time")}
        np.testing.assert_array_equal(arrays["both.y"], log["both.y"])
        np.testing.assert_allclose(arrays["ramp.y.time"], [0.1, 0.4, 0.7, 1.0])


def test_scipy_reads_the_file_of_matlab(path: Path, log: Log, tmp_path: Path) -> None:
    from scipy.io import loadmat

    read = loadmat(exported(path, tmp_path, ".mat"), simplify_cells=True)
    assert read["both_y"]["name"] == "both.y" and read["both_y"]["unit"] == "m"
    np.testing.assert_array_equal(read["both_y"]["values"], log["both.y"])
    np.testing.assert_allclose(read["ramp_y"]["time"], [0.1, 0.4, 0.7, 1.0])


def test_pyulog_reads_the_ulog(path: Path, log: Log, tmp_path: Path) -> None:
    ulog = pytest.importorskip("pyulog").ULog(str(exported(path, tmp_path, ".ulg")))
    assert not ulog.file_corruption
    found = {data.name: data.data for data in ulog.data_list}
    assert found.keys() == {"ramp", "line", "high", "both"}
    np.testing.assert_array_equal(found["both"]["y[1]"], log["both.y"][:, 1])
    np.testing.assert_array_equal(found["high"]["y"], log["high.y"])
    np.testing.assert_array_equal(found["ramp"]["timestamp"], [100_000, 400_000, 700_000, 1_000_000])
    assert ulog.msg_info_dict["sys_name"] == "quadvis"


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["-o", "x.xls"], "'x.xls' has the suffix '.xls'"),
        ([], "say where to, by -o FILE"),
        (["-o", "x.mat", "--every", "1 s"], "only .csv and .parquet have rows of one time"),
        (["-o", "x.npz", "--rate", "slow"], "only .csv and .parquet have rows of one time"),
        (["-o", "x.ulg", "--signals", "ramp.z"], "did you mean 'ramp.y'?"),
        (["-o", "nowhere/x.csv"], "there is no folder 'nowhere'"),
    ],
)
def test_what_cannot_be_exported_gets_a_sentence(
    words: list[str],
    sentence: str,
    path: Path,
    tmp_path: Path,
    capsys: Captured,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["export", str(path), *words]) == 2
    assert sentence in capsys.readouterr().err


def test_a_diagram_needs_a_part(capsys: Captured) -> None:
    assert main(["export", "hover.yaml", "-o", "x.csv"]) == 2
    assert "add --fmu PART to pack a part of a diagram" in capsys.readouterr().err


def test_a_log_is_not_written_over(path: Path, tmp_path: Path, capsys: Captured) -> None:
    (tmp_path / "notes.csv").write_text("mine\n")
    assert main(["export", str(path), "-o", str(tmp_path / "notes.csv")]) == 2
    assert (tmp_path / "notes.csv").read_text() == "mine\n"
