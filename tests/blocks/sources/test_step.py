import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.step import Step


def test_the_step_happens_at_its_instant_and_not_a_tick_later() -> None:
    result = drive(Step(before=-1.0, after=2.0, at=0.3), rate="10 Hz", steps=6)
    assert result.y.tolist() == [-1.0, -1.0, -1.0, 2.0, 2.0, 2.0]


def test_a_step_at_zero_has_happened_from_the_start() -> None:
    assert drive(Step(at=0.0), steps=2).y.tolist() == [1.0, 1.0]


def test_an_instant_that_is_no_number_is_refused() -> None:
    with pytest.raises(ParameterError, match="at must be a number in s"):
        Step(at=[1.0, 2.0])
