"""Tests of the block math.power."""

import numpy as np
import pytest

from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.math.power import Power


def test_it_is_numpy_s_power() -> None:
    u, exponent = np.random.default_rng(1).uniform(0.1, 3.0, (2, 20))
    assert drive(Power(), u=u, exponent=exponent).y == pytest.approx(u**exponent, rel=1e-12)
    assert drive(Power(), u=u.reshape(10, 2), exponent=3.0).y == pytest.approx(
        u.reshape(10, 2) ** 3, rel=1e-12
    )


def test_a_negative_base_takes_whole_exponents_only() -> None:
    assert drive(Power(), u=[-2.0], exponent=[3.0]).y.tolist() == [-8.0]
    with pytest.raises(RunError, match="a value that it does not have"):
        drive(Power(), u=[-2.0], exponent=[0.5])


def test_zero_takes_no_negative_exponent() -> None:
    assert drive(Power(), u=[0.0], exponent=[0.0]).y.tolist() == [1.0]
    with pytest.raises(RunError):
        drive(Power(), u=[0.0], exponent=[-1.0])
