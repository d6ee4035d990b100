"""Tests of the block logic.multiport_switch."""

from pathlib import Path

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.logic.multiport_switch import MultiportSwitch

LOAD = """quadvis: 1
name: switch
rates: {fast: 10 Hz}
stop_time: 0.1 s
blocks:
  y:
    block: logic.multiport_switch
    rate: fast
    with: {outside: refuse}
    in: {index: 3, u: [1 m, 2 m, 3 m]}
"""


def test_the_index_chooses_from_0_on() -> None:
    index = np.array([0, 1, 2, 1])
    y = drive(MultiportSwitch(), index=index, u=[10.0, [1.0, 2.0, 3.0, 4.0], -5.0]).y
    assert y.tolist() == [10.0, 2.0, -5.0, 4.0]


def test_beyond_the_list_the_nearest_signal_counts() -> None:
    index = np.array([-7, 2, 2**40])
    y = drive(MultiportSwitch(), index=index, u=[[[1.0, 2.0]] * 3, [[3.0, 4.0]] * 3]).y
    assert np.array_equal(y, [[1.0, 2.0], [3.0, 4.0], [3.0, 4.0]])


def test_an_index_beyond_the_list_may_end_the_run_with_block_time_and_index() -> None:
    with pytest.raises(RunError, match=r"block 'y'.*t = 0 s.*no place of the list.*\(index = 3"):
        load_text(LOAD, Path.cwd()).run()
    assert load_text(LOAD.replace("index: 3", "index: 2"), Path.cwd()).run()["y.y"].tolist() == [3.0, 3.0]
