"""Tests of the block math.convert."""

from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.errors import DiagramError
from quadvis.testing import drive
from quadvis_blocks.math.convert import Convert

HALVES = [-1.5, -0.5, -0.2, 0.0, 0.2, 0.5, 1.5, 2.5]
LOAD = """quadvis: 1
name: convert
rates: {fast: 10 Hz}
stop_time: 0.1 s
blocks:
  high: {block: logic.compare, rate: fast, in: {a: 1, b: 2}}
  three: {block: signal.sum, rate: fast, in: {u: [WIRE, WIRE, WIRE]}}
"""


def test_truth_values_become_ones_and_zeros() -> None:
    y = drive(Convert(), u=[True, False]).y
    assert y.tolist() == [1.0, 0.0] and y.dtype == float
    y = drive(Convert(gives="int64"), u=[[True, False, True]]).y
    assert y.tolist() == [[1, 0, 1]] and y.dtype == int


def test_numbers_become_whole_by_a_rule() -> None:
    def rounded(rule: str) -> list[int]:
        return drive(Convert(takes="float64", gives="int64", rounding=rule), u=HALVES).y.tolist()

    assert rounded("nearest") == [-2, -1, 0, 0, 0, 1, 2, 3]
    assert rounded("even") == [-2, 0, 0, 0, 0, 0, 2, 2]
    assert rounded("floor") == [-2, -1, -1, 0, 0, 0, 1, 2]
    assert rounded("ceil") == [-1, 0, 0, 0, 1, 1, 2, 3]
    assert rounded("fix") == [-1, 0, 0, 0, 0, 0, 1, 2]
    assert drive(Convert(takes="float64", gives="int64"), u=[HALVES]).y[0].tolist() == rounded("nearest")


def test_what_is_not_zero_is_true() -> None:
    assert drive(Convert(takes="float64", gives="bool"), u=[0.0, -0.0, 0.1, -3.0]).y.tolist() == [
        False, False, True, True,
    ]  # fmt: skip
    assert drive(Convert(takes="int64", gives="bool"), u=[[0, 7]]).y.tolist() == [[False, True]]


def test_whole_numbers_become_numbers() -> None:
    y = drive(Convert(takes="int64", gives="float64"), u=np.array([3, -4])).y
    assert y.tolist() == [3.0, -4.0] and y.dtype == float


def test_one_kind_is_refused() -> None:
    with pytest.raises(ParameterError, match="gives must be another kind than takes, which is bool"):
        Convert(gives="bool")


def test_a_truth_value_in_arithmetic_is_refused_with_this_block_as_the_remedy() -> None:
    with pytest.raises(DiagramError) as caught:
        load_text(LOAD.replace("WIRE", "high.y"), Path.cwd())
    assert {fault.remedy for fault in caught.value.faults} == {"use a block 'math.convert'"}
    assert "input 'u[0]' takes float64, 'high.y' is bool" in str(caught.value)
    number = "  number: {block: math.convert, rate: fast, in: {u: high.y}}\n"
    assert load_text(LOAD.replace("WIRE", "number.y") + number, Path.cwd()).run()["three.y"].tolist() == [
        3.0,
        3.0,
    ]
