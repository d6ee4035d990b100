"""Figure 3 of the paper: the statistics of our comparison, applied to the printed table."""

import numpy as np
import pytest

from quadvis_vision.trials import comparison
from quadvis_vision.trials.comparison import Poses

# x, y, z in the paper's unit of length, three angles in degrees. One heading misprints the method, and one
# number: "-0-2" is -0.2.
FIRST = [
    [0.5, -1.1, 21.2, 10.5, 2.4, -6.9],
    [2.6, -1.0, 33.6, 8.8, -0.2, -4.7],
    [0.7, -5.3, 31.6, 19.3, -0.3, -3.9],
    [8.3, -1.8, 33.5, 15.9, -6.3, 7.5],
]
SECOND = [
    [0.6, -1.1, 18.5, 9.2, 1.6, -8.6],
    [2.8, -1.1, 29.1, 7.9, -0.3, -3.3],
    [0.9, -5.6, 27.9, 18.5, -0.1, -4.3],
    [9.0, -1.8, 30.1, 16.7, -5.0, 6.0],
]


def method(name, rows):
    values = np.array(rows)
    values[:, :3] /= 100  # a unit of the paper taken for a centimetre
    values[:, 3:] = np.radians(values[:, 3:])
    return Poses(name, np.arange(len(rows)) / 10, values)


METHODS = [method("n points", FIRST), method("plane", SECOND)]


def test_the_methods_of_the_paper_differ_by_this_much():
    found = comparison.difference(*METHODS)
    assert found.count == 4
    assert found.rms[:3] * 100 == pytest.approx([0.381, 0.158, 3.633], abs=1e-3)
    assert np.degrees(found.rms[3:]) == pytest.approx([0.972, 0.771, 1.347], abs=1e-3)


def test_the_first_method_of_the_paper_is_farther_away_by_these_ratios():
    assert comparison.difference(*METHODS).ratios == pytest.approx([1.146, 1.155, 1.133, 1.113], abs=1e-3)


def test_the_differences_are_told_with_the_digits_of_the_paper():
    told = comparison.sentences(comparison.differences(METHODS))
    assert told.startswith("n points - plane, rms of 4 pictures: x 0.3808  y 0.1581  z 3.633 cm")
    assert "phi 0.9721  theta 0.7714  psi 1.347 deg" in told
    assert "z ratio 1.1365 (1.1130 to 1.1546)" in told


def test_the_table_is_printed_number_for_number():
    lines = comparison.table(METHODS, [1, 2, 3, 4]).splitlines()
    assert lines[0].split() == ["n", "points", "plane"]
    assert lines[1].split() == ["picture", *["x", "y", "z", "phi", "theta", "psi"] * 2]
    for number, (line, first, second) in enumerate(zip(lines[3:], FIRST, SECOND, strict=True), 1):
        assert [float(word) for word in line.split()] == [number, *first, *second]
