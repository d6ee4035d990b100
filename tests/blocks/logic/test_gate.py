"""Tests of the block logic.gate."""

import itertools
from functools import reduce

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.logic.gate import Gate

TRUTH = {
    "and": all,
    "or": any,
    "xor": lambda values: sum(values) % 2 == 1,
    "nand": lambda values: not all(values),
    "nor": lambda values: not any(values),
}


@pytest.mark.parametrize("name", TRUTH)
@pytest.mark.parametrize("count", [1, 2, 3])
def test_the_whole_truth_table(name: str, count: int) -> None:
    rows = list(itertools.product((False, True), repeat=count))
    wanted = [TRUTH[name](row) for row in rows]
    columns = [list(column) for column in zip(*rows, strict=True)]
    assert drive(Gate(operator=name), u=columns).y.tolist() == wanted
    arrays = [[column] for column in columns]
    assert drive(Gate(operator=name), u=arrays).y[0].tolist() == wanted


def test_not_takes_one_signal() -> None:
    assert drive(Gate(operator="not"), u=[[True, False]]).y.tolist() == [False, True]
    assert drive(Gate(operator="not"), u=[[[True, False]]]).y.tolist() == [[False, True]]
    with pytest.raises(ParameterError, match="operator must be another one than not for 2 signals"):
        drive(Gate(operator="not"), u=[[True], [False]])


def test_many_signals_are_taken_in_one_block() -> None:
    u = np.random.default_rng(1).random((7, 50)) < 0.8
    assert np.array_equal(drive(Gate(), u=list(u)).y, u.all(axis=0))
    assert np.array_equal(drive(Gate(operator="xor"), u=list(u)).y, reduce(np.logical_xor, u))
