"""Tests of the block sources.prbs."""

import numpy as np
import pytest
from scipy.signal import max_len_seq

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.prbs import TAPS, Prbs


@pytest.mark.parametrize("order", [2, 3, 7, 8, 12])
def test_it_is_the_longest_sequence_as_scipy_has_it(order: int) -> None:
    length = 2**order - 1
    wanted = np.where(max_len_seq(order, length=length)[0] == 1, 1.0, -1.0)
    assert np.array_equal(drive(Prbs(order=order), steps=length).y, wanted)


def test_it_repeats_after_its_length_and_not_before() -> None:
    y = drive(Prbs(order=5), steps=93).y
    assert np.array_equal(y[:31], y[31:62]) and np.array_equal(y[:31], y[62:])
    assert y[:31].sum() == 1.0  # one value more of the high ones
    shifted = [float(np.dot(y[:31], np.roll(y[:31], k))) for k in range(31)]
    assert shifted == [31.0] + [-1.0] * 30  # the autocorrelation of such a sequence


@pytest.mark.parametrize("order", [order for order in TAPS if order <= 14])
def test_every_register_comes_back_after_its_full_length(order: int) -> None:
    block = Prbs(order=order)
    register, seen = (1 << order) - 1, 0
    while True:
        fed = bin(register & block.taps).count("1") & 1
        register = register >> 1 | fed << (order - 1)
        seen += 1
        if register == (1 << order) - 1:
            break
    assert seen == 2**order - 1


def test_each_value_lasts_as_long_as_it_should() -> None:
    one, three = drive(Prbs(order=4), steps=15).y, drive(Prbs(order=4, hold=3), steps=45).y
    assert np.array_equal(three, np.repeat(one, 3))
    assert set(drive(Prbs(low=0.0, high=5.0), steps=50).y) == {0.0, 5.0}


def test_orders_without_a_known_register_are_refused() -> None:
    with pytest.raises(ParameterError, match="order must be at most 20"):
        Prbs(order=21)
