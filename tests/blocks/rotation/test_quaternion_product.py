import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadvis.testing import drive
from quadvis_blocks.rotation.quaternion_product import QuaternionProduct

P, Q = (Rotation.random(40, rng=np.random.default_rng(seed)) for seed in (1, 2))


@pytest.mark.parametrize(
    ("conjugate", "wanted"), [("none", P * Q), ("first", P.inv() * Q), ("second", P * Q.inv())]
)
def test_it_is_scipy_s(conjugate: str, wanted: Rotation) -> None:
    p, q = (each.as_quat(scalar_first=True) for each in (P, Q))
    found = drive(QuaternionProduct(conjugate=conjugate), p=p, q=q).y
    right = wanted.as_quat(scalar_first=True)
    assert found * np.sign((found * right).sum(axis=1))[:, None] == pytest.approx(right, abs=1e-12)
