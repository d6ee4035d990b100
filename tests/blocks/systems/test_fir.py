import numpy as np
import pytest
import scipy.signal

from quadvis.testing import drive
from quadvis_blocks.systems.fir import Fir


def test_it_has_the_numbers_of_the_convolution() -> None:
    u = [1, 0.5, -0.25, 2, 0, 0, -1, 3, 1, 1]
    y = [0.1, 0.25, 0.475, 0.55, 0.5, 0.8, 0.275, 0.3, 0.3, 1.3]
    assert drive(Fir(coefficients=[0.1, 0.2, 0.4, 0.2, 0.1]), u=u).y == pytest.approx(y, abs=1e-12)


@pytest.mark.parametrize("taps", [1, 2, 31])
def test_arrays_are_filtered_element_by_element(taps: int) -> None:
    rng = np.random.default_rng(taps)
    c, u = rng.normal(size=taps), rng.normal(size=(70, 2))
    wanted = 3.0 * scipy.signal.lfilter(c, [1.0], u, axis=0)
    assert drive(Fir(coefficients=c, gain=3.0), u=u).y == pytest.approx(wanted, rel=1e-10, abs=1e-12)


def test_it_may_begin_with_inputs_that_have_stood() -> None:
    block = Fir(coefficients=[0.5, 0.25, 0.25], initial_input=[2.0, 4.0])
    assert drive(block, u=[2.0, 4.0], steps=5).y.tolist() == [[2.0, 4.0]] * 5
