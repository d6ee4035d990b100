import numpy as np
import pytest
import scipy.signal

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.biquad import Biquad


def test_one_section_has_the_numbers_of_the_recurrence() -> None:
    u = [1, 0.5, -0.25, 2, 0, 0, -1, 3, 1, 1]
    y = [0.25, 0.325, 0.1975, 0.618, 0.4264, 0.29032, -0.123344, 0.5510208, 0.62536384, 0.763905792]
    assert drive(Biquad(sections=[[0.25, -0.1, 0.05, 1, -1.2, 0.52]]), u=u).y == pytest.approx(y, rel=1e-12)


def test_a_chain_is_scipy_s() -> None:
    u = np.random.default_rng(1).normal(size=(80, 2))
    sections = scipy.signal.ellip(5, 1.0, 40.0, 0.2, output="sos")
    found = drive(Biquad(sections=sections.tolist(), gain=2.0), u=u).y
    assert found == pytest.approx(2.0 * scipy.signal.sosfilt(sections, u, axis=0), rel=1e-10, abs=1e-12)


def test_a_section_without_its_first_coefficient_is_refused() -> None:
    with pytest.raises(ParameterError, match="with an a0 that is not 0"):
        Biquad(sections=[[1, 0, 0, 0, 1, 0]])
