import math

import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.estimation.vehicle_position import VehiclePosition


def test_the_height_is_the_ceiling_less_the_distance_below_it() -> None:
    result = drive(VehiclePosition(target=(0.0, 0.0, 3.0)), camera_position=[0.1, -0.2, 1.8], steps=1)
    assert result.position[0] == pytest.approx([0.1, -0.2, 1.2])


def test_a_target_elsewhere_moves_the_craft_with_it() -> None:
    result = drive(VehiclePosition(target=(10.0, -5.0, 4.0)), camera_position=[0.1, -0.2, 1.0], steps=1)
    assert result.position[0] == pytest.approx([10.1, -5.2, 3.0])


def test_a_target_not_seen_stays_missing() -> None:
    result = drive(VehiclePosition(), camera_position=[math.nan] * 3, steps=1)
    assert np.isnan(result.position).all()


def test_a_target_without_a_height_is_refused() -> None:
    with pytest.raises(ParameterError, match="target must be 3 values"):
        VehiclePosition(target=(0.0, 0.0))
