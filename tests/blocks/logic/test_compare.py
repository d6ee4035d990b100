"""Tests of the block logic.compare."""

import operator
from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.errors import DiagramError
from quadvis.testing import drive
from quadvis_blocks.logic.compare import OPERATORS, Compare

TRUTH = {
    "<": operator.lt, "<=": operator.le, "==": operator.eq, "!=": operator.ne, ">=": operator.ge,
    ">": operator.gt,
}  # fmt: skip
A, B = [1.0, 2.0, 3.0, -0.0], [2.0, 2.0, 2.0, 0.0]


@pytest.mark.parametrize("name", OPERATORS)
def test_it_compares_as_python_does(name: str) -> None:
    wanted = [TRUTH[name](a, b) for a, b in zip(A, B, strict=True)]
    assert drive(Compare(operator=name), a=A, b=B).y.tolist() == wanted
    assert drive(Compare(operator=name), a=[A], b=[B]).y[0].tolist() == wanted


def test_whole_numbers_and_truth_values_are_compared_too() -> None:
    mode = np.array([2, 3, 3])
    assert drive(Compare(operator="==", takes="int64"), a=mode, b=3).y.tolist() == [False, True, True]
    assert drive(Compare(operator="!=", takes="bool"), a=[True, False], b=[True, True]).y.tolist() == [
        False,
        True,
    ]


def test_both_sides_have_one_unit() -> None:
    text = """quadvis: 1
name: compare
rates: {fast: 10 Hz}
stop_time: 0.1 s
blocks:
  x: {block: sources.constant, rate: fast, with: {value: 2 m}}
  y: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: x.y, b: 150 cm}}
"""
    assert load_text(text, Path.cwd()).run()["y.y"].all()
    with pytest.raises(DiagramError, match="'b' has s, its unit here is m"):
        load_text(text.replace("150 cm", "1 s"), Path.cwd())
