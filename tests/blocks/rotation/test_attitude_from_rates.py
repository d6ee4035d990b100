import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.rotation.attitude_from_rates import AttitudeFromRates

BEGIN = [-0.19079108514220006, 0.28057654244471897, 0.1338774132330299, 0.9311027891087327]
END = [-0.3910366543193426, 0.1668895321144866, -0.059028231593343854, -0.903190947100504]


def test_a_constant_rate_is_the_closed_form() -> None:
    y = drive(AttitudeFromRates(initial=BEGIN), rates=[0.5, -1.2, 2.0], steps=2001, rate="1 ms").y
    assert y[-1] * np.sign(y[-1] @ END) == pytest.approx(END, abs=1e-9)
    assert np.linalg.norm(y, axis=1) == pytest.approx(np.ones(2001), abs=1e-12)
    assert ((y[1:] * y[:-1]).sum(axis=1) > 0.0).all()


def test_an_initial_quaternion_of_another_norm_will_do() -> None:
    assert drive(AttitudeFromRates(initial=[0.0, 3.0, 0.0, 4.0]), rates=[0.0, 0.0, 0.0], steps=1).y[
        0
    ] == pytest.approx([0.0, 0.6, 0.0, 0.8])
    with pytest.raises(ParameterError, match="initial must be a quaternion whose norm is not 0"):
        AttitudeFromRates(initial=[0.0, 0.0, 0.0, 0.0])


def test_at_10_rad_per_second_the_norm_stays_1() -> None:
    y = drive(AttitudeFromRates(), rates=[6.0, 0.0, 8.0], steps=500, rate="10 ms").y
    assert np.abs(np.linalg.norm(y, axis=1) - 1.0).max() < 1e-9
