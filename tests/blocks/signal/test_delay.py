"""Tests of the block signal.delay."""

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.delay import Delay


def test_samples_come_out_as_many_ticks_later() -> None:
    u = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert drive(Delay(steps=3, first=[9.0, 8.0, 7.0]), u=u).y.tolist() == [9, 8, 7, 1, 2, 3]
    assert drive(Delay(initial=9.0), u=u).y.tolist() == [9, 1, 2, 3, 4, 5]
    assert drive(Delay(steps=4, initial=0.5), u=u).y.tolist() == [0.5, 0.5, 0.5, 0.5, 1, 2]


def test_arrays_are_delayed_whole() -> None:
    u = np.arange(12.0).reshape(6, 2)
    found = drive(Delay(steps=2, initial=[-1.0, -2.0]), u=u).y
    assert np.array_equal(found, np.vstack([[[-1.0, -2.0]] * 2, u[:4]]))
    found = drive(Delay(steps=2, first=[7.0, 8.0]), u=u).y
    assert np.array_equal(found, np.vstack([[[7.0, 7.0], [8.0, 8.0]], u[:4]]))


def test_matrices_are_delayed_too() -> None:
    u = np.arange(24.0).reshape(6, 2, 2)
    assert np.array_equal(drive(Delay(steps=3), u=u).y[3:], u[:3])


def test_first_outputs_are_as_many_as_the_samples() -> None:
    with pytest.raises(ParameterError, match="first must have one value for each of 3 samples, got 2"):
        Delay(steps=3, first=[1.0, 2.0])
    with pytest.raises(ParameterError, match="steps must be at least 1"):
        Delay(steps=0)
