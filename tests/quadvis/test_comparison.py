"""Rows of two recordings compared bit by bit."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.output.comparison import BlockComparison, SignalDifference
from quadvis.output.recording import RecordedBlock, RecordedPort

BLOCK = RecordedBlock(
    "/eyes",
    (
        RecordedPort("pose", shape=(2, 2), unit="m m rad rad"),
        RecordedPort("count", "int64", unit="1"),
        RecordedPort("valid", "bool"),
    ),
)
POSES = st.lists(st.sampled_from([0.0, 1.0, 2.5, -4.0]), min_size=4, max_size=4)
NAN, OTHER_NAN = 0x7FF8000000000000, 0x7FF8000000000001


def bits(value: float) -> int:
    return int(np.float64(value).view(np.int64))


def row(*pose: float, count: int = 0, valid: int = 0) -> list[int]:
    values = [each if isinstance(each, int) else bits(each) for each in pose]
    return [*values, *[0] * (4 - len(values)), count, valid]


def compared(old: Any, new: Any) -> list[SignalDifference]:
    comparison = BlockComparison(BLOCK)
    comparison.compare(np.array(old, np.int64), np.array(new, np.int64))
    return comparison.differences()


def test_the_first_element_that_differs_has_its_unit_and_both_values() -> None:
    (found,) = compared([row(), row(1.0, 2.0, 3.0)], [row(), row(1.0, 2.0, 3.5, 9.0)])
    assert (found.element, found.unit, found.row) == ("eyes.pose[1,0]", "rad", 1)
    assert (found.values(), found.largest, found.count, found.rows) == (("3.0", "3.5"), 9.0, 1, 2)


@pytest.mark.parametrize(
    ("old", "new", "values", "largest"),
    [
        (0.0, -0.0, ("0.0", "-0.0"), 0.0),
        (NAN, OTHER_NAN, ("nan (bits 7ff8000000000000)", "nan (bits 7ff8000000000001)"), 0.0),
        (NAN, 1.0, ("nan", "1.0"), math.nan),
        (math.inf, 1.0, ("inf", "1.0"), math.inf),
        (1.0, np.nextafter(1.0, 2.0), ("1.0", "1.0000000000000002"), 2.220446049250313e-16),
    ],
)
def test_values_that_differ_in_bits_alone(
    old: float, new: float, values: tuple[str, str], largest: float
) -> None:
    (found,) = compared([row(old)], [row(new)])
    assert found.values() == values
    assert found.largest == largest or (math.isnan(found.largest) and math.isnan(largest))


def test_nan_of_equal_bits_and_infinities_are_the_same() -> None:
    assert compared([row(NAN, math.inf)], [row(NAN, math.inf)]) == []


def test_whole_numbers_and_truth_values() -> None:
    count, valid = compared([row(count=2, valid=1)], [row(count=-3)])
    assert (count.values(), count.largest, count.unit) == (("2", "-3"), 5.0, "")
    assert (valid.values(), valid.largest) == (("True", "False"), 1.0)


@given(
    st.lists(st.tuples(POSES, st.booleans()), max_size=12),
    st.integers(1, 5),
)
def test_pieces_give_what_the_whole_gives(rows: list[tuple[list[float], bool]], size: int) -> None:
    old = np.array([row(*pose) for pose, _ in rows], np.int64).reshape(-1, 6)
    new = np.array([row(*(p + same for p in pose)) for pose, same in rows], np.int64).reshape(-1, 6)
    comparison = BlockComparison(BLOCK)
    for start in range(0, len(old), size):
        comparison.compare(old[start : start + size], new[start : start + size])
    different = [number for number, (_, shifted) in enumerate(rows) if shifted]
    if not different:
        assert comparison.differences() == []
        return
    (found,) = comparison.differences()
    assert (found.row, found.count, found.rows, found.largest) == (
        different[0],
        len(different),
        len(old),
        1.0,
    )
