import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadvis.testing import drive
from quadvis_blocks.rotation.rotate import Rotate

ROTATIONS = Rotation.random(50, rng=np.random.default_rng(1))
V = np.random.default_rng(2).normal(size=(50, 3))
FORMS = {
    "quaternion": 2.0 * ROTATIONS.as_quat(scalar_first=True),
    "dcm": ROTATIONS.as_matrix(),
    "euler": ROTATIONS.as_euler("ZYX")[:, ::-1],
}


@pytest.mark.parametrize("by", FORMS)
def test_it_is_scipy_s_both_ways(by: str) -> None:
    there = drive(Rotate(by=by), attitude=FORMS[by], v=V).y
    assert there == pytest.approx(ROTATIONS.apply(V), abs=1e-10)
    back = drive(Rotate(by=by, direction="to_body"), attitude=FORMS[by], v=there).y
    assert back == pytest.approx(V, abs=1e-10)


def test_it_has_the_numbers_of_the_definition() -> None:
    attitude = np.radians([10.0, -35.0, 200.0])
    found = drive(Rotate(by="euler"), attitude=[attitude], v=[[1.0, -2.0, 0.5]]).y[0]
    assert found == pytest.approx([-1.3948840399554574, 1.6807210364903529, 0.6924415589609973], abs=1e-12)
