import math

import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.sine import Sine


def test_a_sine_goes_through_its_quarter_points() -> None:
    result = drive(Sine(amplitude=3.0, frequency=2.0, bias=1.0), rate="8 Hz", steps=5)
    assert result.y == pytest.approx([1.0, 4.0, 1.0, -2.0, 1.0])


def test_the_phase_moves_it_forward() -> None:
    assert drive(Sine(phase=math.pi / 6), steps=1).y == pytest.approx([0.5])


def test_a_negative_frequency_is_refused() -> None:
    with pytest.raises(ParameterError, match="frequency must be at least 0 Hz, got -1 Hz"):
        Sine(frequency=-1.0)
