"""sources.table"""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.table import Table

ROWS = {"times": [0.1, 0.3, 0.4], "values": [[0.0, 1.0], [2.0, -1.0], [5.0, 0.0]]}


def test_straight_lines_join_the_rows_and_the_ends_stay():
    y = drive(Table(**ROWS), rate="20 Hz", steps=11).y
    time = np.arange(11) / 20
    for column in range(2):
        expected = np.interp(time, ROWS["times"], np.array(ROWS["values"])[:, column])
        assert y[:, column] == pytest.approx(expected, abs=1e-12)


def test_hold_steps_from_row_to_row():
    y = drive(Table(**ROWS, interpolation="hold"), rate="20 Hz", steps=10).y
    # 0, 50 ms | 100 ... 250 ms | 300, 350 ms | 400 ms on
    assert y[:, 0].tolist() == [0.0] * 6 + [2.0] * 2 + [5.0] * 2


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"times": [0.1, 0.3]}, "times must have one entry for each of the 3 rows of values, got 2"),
        ({"times": [0.1, 0.1, 0.2]}, "times must increase"),
    ],
)
def test_a_table_whose_times_do_not_fit_is_refused(changed, words):
    with pytest.raises(ParameterError, match=words):
        Table(**{**ROWS, **changed})
