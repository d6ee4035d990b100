"""Recordings of other programs, played by `sources.recording`: tables, arrays, and what is wrong in them."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import h5py
import hdf5storage
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.cli import main
from quadvis.errors import DiagramError, QuadvisError
from quadvis.output.foreign_signals import read_signals
from quadvis.testing import drive
from quadvis_blocks.sources.recording import Recording

MOTOR = """\
Time (ms),speed [rad/s],pose[0] (m),pose[1] (deg),valid,note (old)
0,1.5,0.1,10,true,1
10,2.5,,,false,2

25,3.5,0.3,30,TRUE,3
"""
DIAGRAM = """
quadvis: 1
name: several
rates: {fast: 10 Hz}
solver: {method: ode4, step: 100 ms}
stop_time: 1 s
blocks:
  ramp: {block: sources.ramp, rate: fast, with: {slope: 1 m/s}}
  more: {block: signal.concatenate, rate: fast, in: {u: [ramp.y, ramp.y]}}
"""


def written(folder: Path, name: str, text: str) -> Path:
    (folder / name).write_text(text)
    return folder / name


def test_a_table_has_units_vectors_truth_and_gaps(tmp_path: Path) -> None:
    found = read_signals(written(tmp_path, "motor.csv", MOTOR))
    assert found.names == ("speed", "pose", "valid", "note (old)")
    assert found.units == {"speed": "rad/s", "pose": "m deg", "valid": "1", "note (old)": "1"}
    assert found.stamps("speed").tolist() == [0, 10_000_000, 25_000_000]
    assert found["speed"].tolist() == [1.5, 2.5, 3.5]
    assert found.stamps("pose").tolist() == [0, 25_000_000]
    assert found["pose"].tolist() == [[0.1, 10.0], [0.3, 30.0]]
    assert found["pose[1]"].tolist() == [10.0, 30.0]
    assert found["valid"].tolist() == [1.0, 0.0, 1.0]


@pytest.mark.parametrize("separator", [";", "\t", ","])
def test_columns_may_be_divided_otherwise(separator: str, tmp_path: Path) -> None:
    text = "\ufefft,a\n0,1\n1,2\n".replace(",", separator)
    assert read_signals(written(tmp_path, "x.csv", text))["a"].tolist() == [1.0, 2.0]


@pytest.mark.parametrize("suffix", ["csv", "parquet", "npz", "mat"])
def test_what_export_writes_is_played_to_the_bit(suffix: str, tmp_path: Path) -> None:
    log, file = tmp_path / "run.mcap", tmp_path / f"run.{suffix}"
    result = load_text(DIAGRAM).run(log=log)
    assert main(["export", str(log), "-o", str(file)]) == 0
    for signal, unit in (("ramp.y", "m"), ("more.y", "m"), ("more.y[1]", "m")):
        if suffix == "mat" and "[" in signal:
            continue
        y = drive(Recording(file=str(file), signal=signal), rate="10 Hz", steps=11).y
        np.testing.assert_array_equal(y, result[signal])
        assert read_signals(file).port(signal).unit == ("1" if suffix == "npz" else unit)


def test_a_block_gets_its_port_from_the_file(tmp_path: Path) -> None:
    written(tmp_path, "motor.csv", MOTOR)
    text = """
quadvis: 1
name: play
rates: {fast: 100 Hz}
stop_time: 30 ms
blocks:
  speed: {block: sources.recording, rate: fast, with: {file: motor.csv, signal: speed, between: linear}}
  twice: {block: signal.gain, rate: fast, with: {factor: 2 s}, in: {u: speed.y}}
"""
    result = load_text(text, tmp_path).run()
    assert result.units["twice.y"] == "rad"
    np.testing.assert_allclose(result["twice.y"], [3.0, 5.0, 5 + 2 * 10 / 15, 7.0])


def test_numbers_of_simulink(tmp_path: Path) -> None:
    """To Workspace writes arrays beside tout, or a structure with time."""
    from scipy.io import savemat

    time = np.arange(3.0)[:, None]
    inner = np.array([{"values": time * 2, "label": "a"}, {"values": time * 3, "label": "b"}], object)
    arrays: dict[str, Any] = {
        "tout": time,
        "speed": np.array([[1.0], [2.0], [3.0]]),
        "scope": {"time": time, "signals": {"values": np.hstack([time, time]), "label": ""}},
        "many": {"time": time, "signals": inner},
    }
    savemat(tmp_path / "x.mat", arrays)
    found = read_signals(tmp_path / "x.mat")
    assert found["speed"].tolist() == [1.0, 2.0, 3.0] and found["speed"].shape == (3,)
    assert found["scope"].shape == (3, 2)
    assert found["many.b"].tolist() == [0.0, 3.0, 6.0]


def in_hdf5(path: Path) -> None:
    """Write what MATLAB's save(..., '-v7.3') does: a head of 512 bytes, the last axis first."""
    with h5py.File(path, "w", userblock_size=512) as file:

        def put(name: str, values: Any, kind: str, group: Any = file) -> Any:
            made = group.create_dataset(name, data=values)
            made.attrs["MATLAB_class"] = np.bytes_(kind)
            return made

        put("t", [[0.0, 0.5, 1.0]], "double")
        put("pose", np.array([[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]).T, "double")
        put("valid", np.array([[1, 0, 1]], np.uint8), "logical")
        put("author", np.array([[ord(letter)] for letter in "Ada"], np.uint16), "char")
        put("gains", [[1.0, 2.0]], "double")
        for name, values in (("a", [[2.0, 3.0, 4.0]]), ("b", [[1.0, 1.0, 0.0]])):
            put(f"#refs#/{name}", values, "double")
            text = [[ord(letter)] for letter in f"speed {name}"]
            put(f"#refs#/label {name}", np.array(text, np.uint16), "char")
        scope = file.create_group("scope")
        put("time", [[0.0, 0.1, 0.2]], "double", scope)
        inner = scope.create_group("signals")
        for name, head in (("values", ""), ("label", "label ")):
            inner[name] = np.array([[file[f"#refs#/{head}{each}"].ref] for each in "ab"], h5py.ref_dtype)
        file["elsewhere"] = h5py.ExternalLink("other.mat", "/t")
    with open(path, "r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")


def test_a_file_of_matlab_7_3(tmp_path: Path) -> None:
    in_hdf5(tmp_path / "x.mat")
    found = read_signals(tmp_path / "x.mat")
    assert found["pose"].tolist() == [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]
    assert found["valid"].dtype == bool and found["valid"].tolist() == [True, False, True]
    assert found.stamps("scope.speed b").tolist() == [0, 100_000_000, 200_000_000]
    assert found["scope.speed a"].tolist() == [2.0, 3.0, 4.0]
    with pytest.raises(QuadvisError, match="'gains': it has 2 rows, and 3 times"):
        found.find("gains")
    y = drive(
        Recording(file=str(tmp_path / "x.mat"), signal="pose[1]", between="linear"), rate="4 Hz", steps=3
    ).y
    assert y.tolist() == [2.0, 3.0, 4.0]


def test_hdf5storage_writes_the_same(tmp_path: Path) -> None:
    time = np.linspace(0, 1, 11)
    values = np.arange(22.0).reshape(11, 2)
    structure = {"time": time, "values": values, "unit": "m/s"}
    arrays = {"tout": time, "speed": values[:, 0], "log": structure}
    for oned_as in ("row", "column"):
        path = tmp_path / f"{oned_as}.mat"
        hdf5storage.savemat(str(path), arrays, format="7.3", oned_as=oned_as, store_python_metadata=False)
        found = read_signals(path)
        np.testing.assert_array_equal(found["log"], values)
        np.testing.assert_array_equal(found["speed"], values[:, 0])
        assert found.port("log").unit == "m/s"


def test_without_h5py_there_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    in_hdf5(tmp_path / "x.mat")
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(QuadvisError, match=r"needs the package h5py; install 'quadvis\[hdf5\]', or save"):
        read_signals(tmp_path / "x.mat")


def test_numbers_in_another_file_are_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
        file.create_dataset("t", (3,), "f8", external=[(str(tmp_path / "secret"), 0, 24)])
    with pytest.raises(QuadvisError, match="'/t' lies in another file; save it into this one"):
        read_signals(tmp_path / "x.mat")


def test_cells_that_hold_one_another_end(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "x.mat", "w", userblock_size=512) as file:
        cell = file.create_dataset("a", (2,), h5py.ref_dtype)
        cell[:] = [cell.ref, cell.ref]
    with pytest.raises(QuadvisError, match="nested deeper than 16"):
        read_signals(tmp_path / "x.mat")


def test_arrays_have_times_of_their_own_or_those_of_all(tmp_path: Path) -> None:
    arrays: dict[str, Any] = {
        "t": [0.0, 1.0], "a": [1, 2], "b": [True, False, True], "b.time": [0.0, 0.5, 1.0]
    }  # fmt: skip
    np.savez(tmp_path / "x.npz", **arrays)
    found = read_signals(tmp_path / "x.npz")
    assert found["a"].dtype == np.int64 and found["b"].dtype == bool
    assert found.stamps("b").tolist() == [0, 500_000_000, 1_000_000_000]


@given(
    times=st.lists(st.integers(0, 10**9), min_size=1, max_size=20, unique=True).map(sorted),
    data=st.data(),
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30, deadline=None)
def test_numbers_come_through_a_table_to_the_bit(times: list[int], data: Any, tmp_path: Path) -> None:
    numbers = st.floats(allow_nan=False, allow_infinity=True)
    values = data.draw(st.lists(numbers, min_size=len(times), max_size=len(times)))
    lines = [f"{time},{value!r}" for time, value in zip(times, values, strict=True)]
    found = read_signals(written(tmp_path, "x.csv", "\n".join(["t (ns),x", *lines])))
    assert found.stamps("x").tolist() == times and found["x"].tolist() == values


@given(data=st.binary(max_size=300), suffix=st.sampled_from(["csv", "parquet", "npz", "mat"]))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=60, deadline=None)
def test_any_bytes_are_read_or_refused_in_a_sentence(data: bytes, suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"x.{suffix}"
    path.write_bytes(data)
    try:
        read_signals(path)
    except QuadvisError as error:
        assert str(path) in str(error)


@pytest.mark.parametrize(
    ("name", "text", "sentence"),
    [
        ("x.csv", "", "the file is empty"),
        ("x.csv", "a,b\n1,2\n", "no column has the time; call one 'time (s)'"),
        ("x.csv", "t,a\n0,1\n1\n", "line 3 has 1 cells, the first line 2"),
        ("x.csv", "t,a\n0,1\n1,one\n", "line 3: 'one' in column 'a' is no number"),
        ("x.csv", "t,a\n,1\n", "column 't' has empty cells; each row needs its time"),
        ("x.csv", "t (m),a\n0,1\n", "'t' is in m, which is no time"),
        ("x.csv", "t,a\nnan,1\n", "'t' has times that are no numbers"),
        ("x.parquet", "t,a\n", "this is no Parquet file that can be read"),
        ("x.npz", "t,a\n", "this is no file of numpy.savez that can be read"),
        ("x.mat", "t,a\n", "it is no .mat file that can be read"),
    ],
)
def test_what_is_wrong_in_a_file_gets_a_sentence(name: str, text: str, sentence: str, tmp_path: Path) -> None:
    with pytest.raises(QuadvisError) as caught:
        read_signals(written(tmp_path, name, text))
    assert str(caught.value).startswith(f"'{tmp_path / name}': {sentence}")


def test_a_signal_that_is_not_there_and_times_that_go_back(tmp_path: Path) -> None:
    file = str(written(tmp_path, "x.csv", "t,speed\n1,1\n0,2\n"))
    with pytest.raises(ParameterError, match="did you mean 'speed'"):
        Recording(file=file, signal="sped")
    with pytest.raises(ParameterError, match="go back"):
        Recording(file=file, signal="speed")


def test_pickles_are_refused(tmp_path: Path) -> None:
    np.savez(tmp_path / "x.npz", t=np.array([0.0]), a=np.array([{"a": 1}], object))
    with pytest.raises(QuadvisError, match=r"cannot be loaded|can be read"):
        read_signals(tmp_path / "x.npz")


def test_a_fault_of_a_file_has_its_place_in_the_diagram(tmp_path: Path) -> None:
    written(tmp_path, "x.csv", "a,b\n1,2\n")
    text = (
        "quadvis: 1\nname: play\nrates: {fast: 100 Hz}\nstop_time: 30 ms\nblocks:\n"
        "  s: {block: sources.recording, rate: fast, with: {file: x.csv, signal: b}}\n"
    )
    with pytest.raises(DiagramError, match=r":6:\d+: block 's': .*no column has the time"):
        load_text(text, tmp_path)
