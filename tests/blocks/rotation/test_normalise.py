import numpy as np
import pytest

from quadvis.errors import RunError
from quadvis.testing import drive
from quadvis_blocks.rotation.normalise import Normalise


def test_the_direction_has_length_1() -> None:
    u = np.random.default_rng(1).normal(size=(30, 4)) * 5.0
    found = drive(Normalise(), u=u)
    assert found.norm == pytest.approx(np.linalg.norm(u, axis=1), rel=1e-12)
    assert found.y == pytest.approx(u / np.linalg.norm(u, axis=1)[:, None], rel=1e-12)


def test_a_vector_of_length_0_ends_the_run() -> None:
    with pytest.raises(RunError, match="a vector of length 0 has no direction"):
        drive(Normalise(), u=[[0.0, 0.0]])
