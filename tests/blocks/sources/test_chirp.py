"""Tests of the block sources.chirp."""

import numpy as np
import pytest
from scipy.signal import chirp

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.chirp import Chirp


@pytest.mark.parametrize("sweep", ["linear", "logarithmic"])
@pytest.mark.parametrize(("first", "last"), [(0.5, 20.0), (20.0, 0.5), (3.0, 3.0)])
def test_it_is_scipy_s_chirp(sweep: str, first: float, last: float) -> None:
    block = Chirp(amplitude=2.0, bias=0.5, first=first, last=last, duration=5.0, sweep=sweep)
    driven = drive(block, rate="200 Hz", steps=1000)
    wanted = 0.5 + 2.0 * chirp(driven.time, first, 5.0, last, method=sweep, phi=-90)
    assert driven.y == pytest.approx(wanted, abs=1e-9)


def test_before_and_after_it_rests() -> None:
    y = drive(Chirp(begin=0.5, duration=1.0, bias=3.0), rate="10 Hz", steps=20).y
    assert (y[:5] == 3.0).all() and (y[15:] == 3.0).all() and (y[6:15] != 3.0).all()


def test_a_frequency_above_half_the_rate_is_doubtful() -> None:
    (doubt,) = Chirp(last=60.0, period=0.01).doubts()
    assert doubt.parameter == "last" and "above half the rate of the block, 50 Hz" in str(doubt)


def test_no_factor_leads_from_zero() -> None:
    with pytest.raises(ParameterError, match="first must be above 0 Hz for a logarithmic sweep"):
        Chirp(first=0.0, sweep="logarithmic")


def test_its_phase_is_the_integral_of_its_frequency() -> None:
    driven = drive(Chirp(first=1.0, last=5.0, duration=2.0), rate="500 Hz", steps=1000)
    crossings = int((np.diff(np.sign(driven.y)) > 0).sum())
    assert crossings == pytest.approx(6, abs=1)  # (1 + 5) / 2 Hz times 2 s
