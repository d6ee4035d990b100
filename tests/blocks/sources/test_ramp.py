import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.sources.ramp import Ramp


def test_a_ramp_waits_for_its_beginning_and_then_grows_by_its_slope() -> None:
    result = drive(Ramp(slope=-2.0, initial=5.0, begin=0.2), rate="10 Hz", steps=5)
    assert result.y == pytest.approx([5.0, 5.0, 5.0, 4.8, 4.6])


def test_an_unknown_parameter_is_refused() -> None:
    with pytest.raises(ParameterError, match="no parameter 'slop'; did you mean 'slope'"):
        Ramp(slop=1.0)
