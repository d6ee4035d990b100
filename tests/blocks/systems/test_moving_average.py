import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.systems.moving_average import MovingAverage


@pytest.mark.parametrize("samples", [1, 2, 5, 13])
def test_it_is_the_mean_of_the_samples_that_there_are(samples: int) -> None:
    u = np.random.default_rng(samples).normal(size=50)
    wanted = [u[max(0, k + 1 - samples) : k + 1].mean() for k in range(50)]
    assert drive(MovingAverage(samples=samples), u=u).y == pytest.approx(wanted, rel=1e-12, abs=1e-14)
    both = drive(MovingAverage(samples=samples), u=np.stack([u, -u], 1)).y
    assert both == pytest.approx(np.stack([wanted, np.negative(wanted)], 1), rel=1e-12, abs=1e-14)


def test_what_has_left_the_window_leaves_no_trace() -> None:
    """A sum from which old samples were subtracted would keep the rounding of 1e16."""
    u = np.concatenate([[1e16, 0.1], np.full(40, 0.1)])
    assert drive(MovingAverage(samples=4), u=u).y[8:] == pytest.approx(np.full(34, 0.1), rel=1e-15)
