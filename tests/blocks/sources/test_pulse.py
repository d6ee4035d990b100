import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.pulse import Pulse


def test_a_pulse_rises_and_falls_on_its_instants() -> None:
    block = Pulse(low=-1.0, high=2.0, interval=0.5, width=0.2, begin=0.3)
    result = drive(block, rate="10 Hz", steps=12)
    assert result.y.tolist() == [-1, -1, -1, 2, 2, -1, -1, -1, 2, 2, -1, -1]


def test_no_edge_is_lost_to_rounding_in_ten_thousand_pulses() -> None:
    result = drive(Pulse(interval=0.3, width=0.1), rate="10 Hz", steps=30000)
    assert np.array_equal(result.y, [1.0, 0.0, 0.0] * 10000)


@pytest.mark.parametrize(("width", "value"), [(0.0, 0.0), (1.0, 1.0)])
def test_no_width_is_always_low_and_full_width_always_high(width: float, value: float) -> None:
    assert set(drive(Pulse(width=width), rate="10 Hz", steps=25).y) == {value}


def test_a_pulse_longer_than_its_interval_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"width must be at most the interval, 1 s, got 1\.5 s"):
        Pulse(width=1.5)
