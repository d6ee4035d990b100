"""Arrays out of files: NumPy's and MATLAB's own writers, and damaged and foreign files."""

from __future__ import annotations

import contextlib
import re
import sys
import tempfile
from pathlib import Path
from typing import Any

import hdf5storage
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import savemat

from quadvis.api import load_text
from quadvis.document.array_file import chosen, read_arrays
from quadvis.errors import QuadvisError

K = np.array([[1.0, -2.5, 1e-7], [4, 5, 1 / 3]])


def _write(folder: Path, name: str) -> str:
    path = folder / name
    if path.suffix == ".npz":
        np.savez(path, K=K, v=K[0], words=np.array([1, 2]))
    elif path.suffix == ".npy":
        np.save(path, K)
    elif path.suffix == ".mat":
        savemat(path, {"K": K, "v": K[0], "title": "gains", "one": {"x": 1}})
    elif path.suffix == ".yaml":
        path.write_text(f"quadvis: 1\nK: {K.tolist()}\nv: {K[0].tolist()}\nname: gains\n")
    else:
        np.savetxt(path, K, delimiter=",", fmt="%.17g", header="x,y,z", comments="")
    return str(path)


@pytest.mark.parametrize("name", ["k.npz", "k.mat", "k.yaml"])
def test_arrays_have_names(name: str, tmp_path: Path) -> None:
    found = read_arrays(_write(tmp_path, name))
    assert np.array_equal(chosen(found, "K"), K)
    assert np.array_equal(np.ravel(chosen(found, "v")), K[0])
    with pytest.raises(QuadvisError, match="it has no array 'k'; did you mean 'K'"):
        chosen(found, "k")
    with pytest.raises(QuadvisError, match="it has several arrays; add 'name:' with one of"):
        chosen(found, None)


def _both(folder: Path, arrays: dict[str, Any]) -> list[dict[str, Any]]:
    """Return what is read of arrays as scipy writes them in version 5, and hdf5storage in 7.3."""
    savemat(folder / "5.mat", arrays)
    path = str(folder / "7.mat")
    hdf5storage.savemat(path, arrays, format="7.3", oned_as="row", store_python_metadata=False)
    return [dict(read_arrays(str(folder / name))) for name in ("5.mat", "7.mat")]


def test_matlab_7_3_gives_what_earlier_versions_give(tmp_path: Path) -> None:
    arrays = {
        "K": K, "row": K[:1], "column": K[:, :1], "one": np.array([[3.5]]), "v": K[0],
        "poles": np.array([[-1 + 2j, -1 - 2j]]), "cube": np.arange(24.0).reshape(2, 3, 4),
        "whole": np.array([[1, 2]], np.int16), "on": np.array([[True, False]]),
        "title": "gains", "inner": {"x": 1.0},
    }  # fmt: skip
    early, late = _both(tmp_path, arrays)
    assert set(early) == set(late) == set(arrays) - {"title", "inner"}
    for name in late:
        assert early[name].dtype == late[name].dtype, name
        assert np.array_equal(early[name], late[name]), name
    assert np.array_equal(late["K"], K) and late["one"].shape == (1, 1)


def test_a_diagram_takes_a_matrix_from_a_file_of_matlab_7_3(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    _both(tmp_path, {"K": K, "other": K[0]})
    text = """
quadvis: 1
name: gains
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  u: {block: sources.constant, rate: fast, with: {value: {value: [1, 2, 3], unit: m}}}
  y: {block: math.matrix_gain, rate: fast, with: {gain: {file: 7.mat, name: K, unit: N/m}}, in: {u: u.y}}
"""
    result = load_text(text).run(engine="python")
    assert result["y.y"][-1] == pytest.approx(K @ [1, 2, 3])


def test_version_7_3_needs_h5py(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    _both(tmp_path, {"K": K})
    monkeypatch.setitem(sys.modules, "h5py", None)
    with pytest.raises(QuadvisError, match=r"needs the package h5py; install 'quadvis\[hdf5\]', or save"):
        read_arrays(str(tmp_path / "7.mat"))
    assert np.array_equal(read_arrays(str(tmp_path / "5.mat"))["K"], K)


@pytest.mark.parametrize("name", ["k.npy", "k.csv"])
def test_a_single_array_needs_no_name(name: str, tmp_path: Path) -> None:
    assert np.array_equal(chosen(read_arrays(_write(tmp_path, name)), None), K)


@pytest.mark.parametrize("separator", [",", ";", "\t", "  "])
def test_tables_have_columns_by_name(separator: str, tmp_path: Path) -> None:
    path = tmp_path / "t.csv"
    path.write_text(f"# a table\nx{separator}y\n1{separator}2\n\n3{separator}4.5\n")
    found = read_arrays(str(path))
    assert chosen(found, None).tolist() == [[1, 2], [3, 4.5]]
    assert chosen(found, "y").tolist() == [2, 4.5]


@pytest.mark.parametrize(
    ("name", "contents", "words"),
    [
        ("k.dat", b"1", "the arrays of a '.dat' file cannot be read; give one of .csv, .txt, .npy, .npz"),
        ("k.txt", b"K\n1 secret\n", "line 2 is no row of numbers"),
        ("k.txt", b"K\n1 2\n3\nL\n1\n", "line 3 has 1 numbers, the row above has 2"),
        ("k.csv", b"1,2\n3\n", "its lines are not equally long rows of numbers"),
        ("k.csv", b"a,b\n1,secret\n", "its lines are not all rows of numbers"),
        ("k.csv", b"", "its lines are not equally long rows of numbers"),
        ("k.npy", b"\x93NUMPY", "it is no .npy file that can be read: ValueError"),
        ("k.npz", b"PK", "it is no .npz file that can be read: BadZipFile"),
        ("k.mat", b"secret", "it is no .mat file that can be read: "),
        ("k.mat", b"\x89HDF\r\n\x1a\n secret", "it is no .mat file that can be read: "),
        ("k.yaml", b"a: [1, secret]\n", "it has no lists of numbers under names"),
        ("k.yaml", b"a: [[1, 2], [3]]\n", "it has no lists of numbers under names"),
    ],
)  # fmt: skip
def test_what_is_no_array_is_refused_unquoted(name: str, contents: bytes, words: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(contents)
    with pytest.raises(QuadvisError, match=re.escape(words)) as caught:
        read_arrays(str(path))
    assert "secret" not in str(caught.value)


@pytest.mark.parametrize(
    "array", [np.array([1.0, np.nan]), np.array([1j]), np.zeros((0, 2)), np.array(["a"])]
)
def test_arrays_that_are_no_numbers_are_refused(array: Any, tmp_path: Path) -> None:
    np.save(tmp_path / "k.npy", array)
    with pytest.raises(QuadvisError, match=r"not finite|no numbers|no real numbers|shape"):
        chosen(read_arrays(str(tmp_path / "k.npy")), None)


NAMED = "# a model\nA\n0 1   # of rows\n-2 -3\n\nB\n0\n1\npoles\n-1+2i, -1-2i\n"


def test_names_may_stand_above_the_rows_of_a_text(tmp_path: Path) -> None:
    (tmp_path / "k.txt").write_text(NAMED.replace(", ", " "))
    (tmp_path / "k.csv").write_text(NAMED.replace("0 1 ", "0, 1 ").replace("-2 -3", "-2, -3"))
    for name in ("k.txt", "k.csv"):
        found = read_arrays(str(tmp_path / name))
        assert chosen(found, "A").tolist() == [[0, 1], [-2, -3]]
        assert chosen(found, "B").tolist() == [[0], [1]]
        assert found["poles"].tolist() == [[-1 + 2j, -1 - 2j]]
        with pytest.raises(QuadvisError, match="array 'poles' has no real numbers"):
            chosen(found, "poles")


def test_a_column_below_its_name_is_a_table(tmp_path: Path) -> None:
    (tmp_path / "k.csv").write_text("x\n1\n2\n")
    found = read_arrays(str(tmp_path / "k.csv"))
    assert (chosen(found, None).tolist(), chosen(found, "x").tolist()) == ([[1], [2]], [1, 2])


def test_single_numbers_of_yaml_are_asked_for_by_name(tmp_path: Path) -> None:
    (tmp_path / "k.yaml").write_text("K: [1, 2]\ndt: 0.1\nname: gains\n")
    found = read_arrays(str(tmp_path / "k.yaml"))
    assert chosen(found, None).tolist() == [1, 2]
    (tmp_path / "p.yaml").write_text("poles: [-2, -1+3j, -1-3j]\n")
    assert read_arrays(str(tmp_path / "p.yaml"))["poles"].tolist() == [-2, -1 + 3j, -1 - 3j]
    assert float(chosen(found, "dt")) == 0.1


def test_pickles_are_not_read(tmp_path: Path) -> None:
    np.save(tmp_path / "k.npy", np.array([{}], dtype=object), allow_pickle=True)
    with pytest.raises(QuadvisError, match=r"it is no \.npy file"):
        read_arrays(str(tmp_path / "k.npy"))


@given(kind=st.sampled_from(["csv", "txt", "npy", "npz", "mat", "yaml"]), data=st.binary(max_size=200))
def test_damaged_files_end_in_a_sentence(kind: str, data: bytes) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, f"k.{kind}")
        path.write_bytes(data)
        with contextlib.suppress(QuadvisError):
            read_arrays(str(path))
