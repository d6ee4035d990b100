"""Tests of the block logic.part_output: what a part gives to the outside."""

import numpy as np
import pytest

from quadvis.block import Frame
from quadvis.testing import drive
from quadvis_blocks.logic.part_output import PartOutput


def test_a_number_is_shown_or_the_initial_one() -> None:
    y = drive(PartOutput(), u=[1.0, 2.0, np.nan], shown=[False, True, True], initial=-1.0).y
    assert y[:2].tolist() == [-1.0, 2.0]
    assert np.isnan(y[2])


def test_the_initial_value_is_zero_by_default_for_arrays_too() -> None:
    y = drive(PartOutput(), u=[[1.0, 2.0]] * 2, shown=[False, True]).y
    assert y.tolist() == [[0.0, 0.0], [1.0, 2.0]]


@pytest.mark.parametrize(("kind", "values"), [("bool", [True, True, False]), ("int64", [3, 4, 5])])
def test_other_kinds_are_shown_as_they_are(kind: str, values: list[int]) -> None:
    y = drive(PartOutput(kind=kind), u=values, shown=[False, True, True]).y
    assert y.tolist() == [0, *values[1:]]


def test_a_picture_is_shown_or_none() -> None:
    picture = Frame(np.zeros((2, 2, 3), np.uint8), 0.0, 1)
    seen = drive(PartOutput(kind="frame"), u=[picture, picture], shown=[False, True]).y
    assert [bool(frame) for frame in seen] == [bool(Frame.none()), bool(picture)]
