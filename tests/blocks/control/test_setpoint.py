import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.setpoint import Setpoint


def test_it_gives_its_parameter_as_position_and_heading() -> None:
    result = drive(Setpoint(target=(1.0, -2.0, 1.5, 0.3)), steps=2)
    assert np.array_equal(result.position, [[1.0, -2.0, 1.5]] * 2)
    assert result.heading.tolist() == [0.3, 0.3]


def test_the_target_may_be_tuned_and_has_its_units() -> None:
    param = Setpoint.interface.params["target"]
    assert param.tune and param.unit == "m m m rad"


def test_a_target_without_a_heading_is_refused() -> None:
    with pytest.raises(ParameterError, match="target must be 4 values"):
        Setpoint(target=(0.0, 0.0, 1.5))
