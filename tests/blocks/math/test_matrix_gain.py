"""Tests of the block math.matrix_gain."""

from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.math.matrix_gain import MatrixGain

LOOP = """quadvis: 1
name: feedback
rates: {fast: 10 Hz}
stop_time: 0.1 s
blocks:
  x: {block: sources.constant, rate: fast, with: {value: {value: [1, 2], unit: m m/s}}}
  k: {block: math.matrix_gain, rate: fast, with: {WITH}, in: {u: x.y}}
"""


def test_it_is_numpy_s_product() -> None:
    rng = np.random.default_rng(1)
    gain, u = rng.normal(size=(3, 4)), rng.normal(size=(20, 4))
    assert drive(MatrixGain(gain=gain), u=u).y == pytest.approx(u @ gain.T, rel=1e-12, abs=1e-12)


def test_a_scalar_counts_as_a_vector_of_one_element() -> None:
    assert np.array_equal(drive(MatrixGain(gain=[[2.0], [-1.0]]), u=[3.0]).y, [[6.0, -3.0]])


def test_a_vector_of_another_length_is_refused() -> None:
    with pytest.raises(TypeError, match="input 'u' has shape"):
        drive(MatrixGain(gain=[[1.0, 2.0]]), u=[[1.0, 2.0, 3.0]])


def test_the_matrix_may_stand_in_a_file(tmp_path: Path) -> None:
    (tmp_path / "k.csv").write_text("# of the LQR\n1, -2  # first row\n\n0.5; 1e3\n")
    diagram = load_text(LOOP.replace("WITH", "file: k.csv"), tmp_path)
    assert diagram.run()["k.y"][-1].tolist() == [-3.0, 2000.5]
    again = load_text(diagram.resolved, tmp_path)
    assert again.run()["k.y"][-1].tolist() == [-3.0, 2000.5]


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("1 2\n3\n", "line 2 has 1 numbers, the first row has 2"),
        ("1 two\n", "line 1 is no row of numbers: '1 two'"),
        ("1 nan\n", "line 1 has a number that is not finite"),
        ("# nothing\n", "there is no row of numbers"),
    ],
)
def test_a_file_that_is_no_matrix_is_refused(text: str, problem: str, tmp_path: Path) -> None:
    (tmp_path / "k.csv").write_text(text)
    with pytest.raises(ParameterError, match=f"file is not usable: {problem}"):
        MatrixGain(file=str(tmp_path / "k.csv"))


def test_a_file_and_another_matrix_are_refused(tmp_path: Path) -> None:
    (tmp_path / "k.csv").write_text("1 2\n")
    with pytest.raises(ParameterError, match="gain must be left out where a file has the matrix"):
        MatrixGain(file=str(tmp_path / "k.csv"), gain=[[1.0, 3.0]])
