"""Tests of the block signal.lookup_2d."""

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from quadvis.block import ParameterError
from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.signal.lookup_2d import Lookup2d

ROWS, COLUMNS = [0, 1, 3], [0, 2, 5, 6]
VALUES = [[1, 2, 0, 4], [3, -1, 5, 2], [0, 6, 1, 1]]
AT = [[0, 0], [0.5, 1], [1, 2], [2.2, 5.5], [3, 6], [-1, 1], [4, 7], [1, 9], [3, 0]]
HELD = [1.0, 1.25, -1.0, 2.0, 1.0, 1.5, 1.0, 2.0, 0.0]
GOES_ON = [1.0, 1.25, -1.0, 2.0, 1.0, 2.0, 2.0, -7.0, 0.0]


def table(**given: str) -> Lookup2d:
    return Lookup2d(rows=ROWS, columns=COLUMNS, values=VALUES, **given)


def at(block: Lookup2d, places: list[list[float]]) -> list[float]:
    row, column = np.transpose(places)
    found = drive(block, row=row, column=column).y
    assert np.array_equal(drive(block, row=[row], column=[column]).y[0], found)
    return found.tolist()


def test_held_and_extrapolated_outside() -> None:
    assert at(table(), AT) == pytest.approx(HELD, abs=1e-12)
    assert at(table(outside_rows="linear", outside_columns="linear"), AT) == pytest.approx(GOES_ON, abs=1e-12)


def test_the_four_sides_and_corners_follow_each_axis_by_itself() -> None:
    sides = [[-1, 1], [4, 1], [0.5, -2], [0.5, 7], [-1, -2], [-1, 7], [4, -2], [4, 7]]
    # Rows go on, columns are held: along the rows at the columns 1, 1, 0, 6, 0, 6, 0, 6.
    wanted = [2.0, 4.0, 2.0, 3.0, -1.0, 6.0, -1.5, 0.5]
    assert at(table(outside_rows="linear"), sides) == pytest.approx(wanted, abs=1e-12)


def test_it_is_scipy_s_interpolation() -> None:
    rng = np.random.default_rng(1)
    rows, columns, values = np.sort(rng.normal(size=7)), np.sort(rng.normal(size=5)), rng.normal(size=(7, 5))
    row, column = rng.uniform(rows[0], rows[-1], 100), rng.uniform(columns[0], columns[-1], 100)
    found = drive(Lookup2d(rows=rows, columns=columns, values=values), row=row, column=column).y
    wanted = RegularGridInterpolator((rows, columns), values)(np.column_stack([row, column]))
    assert found == pytest.approx(wanted, abs=1e-12)


def test_at_every_pair_of_breakpoints_it_is_the_value_of_the_table_to_the_bit() -> None:
    rng = np.random.default_rng(2)
    rows, columns, values = np.sort(rng.normal(size=7)), np.sort(rng.normal(size=5)), rng.normal(size=(7, 5))
    row, column = (grid.ravel() for grid in np.meshgrid(rows, columns, indexing="ij"))
    block = Lookup2d(
        rows=rows, columns=columns, values=values, outside_rows="refuse", outside_columns="linear"
    )
    assert np.array_equal(drive(block, row=row, column=column).y, values.ravel())


def test_an_input_outside_may_end_the_run() -> None:
    with pytest.raises(RunError, match=r"outside the table \(row = 0, column = 6\.5\)"):
        drive(table(outside_columns="refuse"), row=[0.0], column=[6.5])


def test_what_is_missing_is_missing() -> None:
    block = table(outside_rows="refuse")
    assert np.isnan(type(block).output(block, float("nan"), 1.0))
    assert np.isnan(type(block).output(block, 1.0, float("nan")))


def test_breakpoints_that_do_not_rise_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"columns must rise; \[1\] is 0, after 0"):
        Lookup2d(rows=[0, 1], columns=[0, 0], values=[[1, 2], [3, 4]])
