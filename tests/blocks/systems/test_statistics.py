import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.systems.statistics import Statistics


def test_it_has_the_numbers_of_the_closed_form() -> None:
    t = np.arange(1000) / 1000
    x = 1.5 + 2.0 * np.sin(2 * np.pi * 50 * t + 0.3) + 0.5 * np.cos(2 * np.pi * 120 * t)
    found = drive(Statistics(samples=1000), u=x, rate="1 kHz")
    assert found.rms[-1] == pytest.approx(2.091650066335189, abs=1e-10)
    assert found.mean[-1] == pytest.approx(1.5, abs=1e-10)
    assert found.peak[-1] == np.abs(x).max()


@pytest.mark.parametrize("samples", [1, 2, 7])
def test_it_is_numpy_s_over_each_window(samples: int) -> None:
    u = np.random.default_rng(samples).normal(size=(40, 2))
    found = drive(Statistics(samples=samples), u=u)
    windows = [u[max(0, k + 1 - samples) : k + 1] for k in range(40)]
    assert found.mean == pytest.approx(np.array([w.mean(axis=0) for w in windows]), rel=1e-12, abs=1e-13)
    wanted = np.array([np.sqrt((w * w).mean(axis=0)) for w in windows])
    assert found.rms == pytest.approx(wanted, rel=1e-12)
    assert np.array_equal(found.peak, [np.abs(w).max(axis=0) for w in windows])
    assert np.array_equal(drive(Statistics(samples=samples), u=u[:, 1]).rms, found.rms[:, 1])
