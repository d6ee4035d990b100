from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from quadvis.testing import drive
from quadvis_blocks._rotations import (
    dcm_of_euler,
    dcm_of_quaternion,
    euler_of_dcm,
    quaternion_of_dcm,
    quaternion_of_euler,
)
from quadvis_blocks.rotation.representation import KINDS, Representation

ANGLES = np.radians([10.0, -35.0, 200.0])
QUATERNION = [0.19079108514220006, -0.28057654244471897, -0.1338774132330299, -0.9311027891087327]
DCM = [
    [-0.7697511313200572, 0.4304179464587011, 0.4714059685640041],
    [-0.28016649959323553, -0.8913512001125886, 0.35637027171682195],
    [0.573576436351046, 0.14224425972292404, 0.8067072841115988],
]
FORMS: dict[str, Any] = {"euler": np.radians([10.0, -35.0, -160.0]), "quaternion": QUATERNION, "dcm": DCM}


@pytest.mark.parametrize("kind", KINDS)
def test_it_has_the_numbers_of_the_definition(kind: str) -> None:
    given, _, wanted = kind.partition("_to_")
    u = ANGLES if given == "euler" else FORMS[given]
    found = drive(Representation(kind=kind), u=u, steps=2).y
    assert found[0] == pytest.approx(np.asarray(FORMS[wanted]), abs=1e-12)
    assert np.array_equal(found[0], found[1])


@pytest.mark.parametrize("kind", KINDS)
def test_it_is_scipy_s(kind: str) -> None:
    rotations = Rotation.random(100, rng=np.random.default_rng(1))
    forms = {
        "euler": rotations.as_euler("ZYX")[:, ::-1],
        "quaternion": rotations.as_quat(canonical=True, scalar_first=True),
        "dcm": rotations.as_matrix(),
    }
    given, _, wanted = kind.partition("_to_")
    found, right = drive(Representation(kind=kind), u=forms[given]).y, forms[wanted]
    if wanted == "quaternion":  # which has a sign of its own
        right = right * np.sign((found * right).sum(axis=1))[:, None]
    assert found == pytest.approx(right, abs=1e-10)


def test_angles_give_their_rotation_back_at_the_poles_too() -> None:
    rng = np.random.default_rng(2)
    rotations = [*Rotation.random(2000, rng=rng).as_matrix()]
    for pole in (np.pi / 2, -np.pi / 2):
        for off in (0.0, 1e-13, 1e-9, 1e-6):
            turns = rng.uniform(-np.pi, np.pi, (20, 2))
            rotations += [
                Rotation.from_euler("ZYX", [yaw, pole - np.sign(pole) * off, roll]).as_matrix()
                for roll, yaw in turns
            ]
    for matrix in rotations:
        assert np.abs(dcm_of_euler(euler_of_dcm(matrix)) - matrix).max() < 1e-9
        assert np.abs(dcm_of_quaternion(quaternion_of_dcm(matrix)) - matrix).max() < 1e-9


def test_at_a_pole_roll_is_zero() -> None:
    angles = euler_of_dcm(dcm_of_quaternion(np.array([1.0, 0.0, 1.0, 0.0]) / np.sqrt(2.0)))
    assert angles[0] == 0.0
    assert angles[1] == pytest.approx(np.pi / 2)


@pytest.mark.parametrize("kind", ["euler_to_quaternion", "dcm_to_quaternion"])
def test_the_sign_of_a_quaternion_does_not_jump(kind: str) -> None:
    yaw = np.linspace(0.0, 6.0 * np.pi, 200)
    angles = np.stack([0.1 * np.sin(yaw), 0.2 * np.cos(yaw), yaw], 1)
    u = angles if kind.startswith("euler") else np.array([dcm_of_euler(each) for each in angles])
    q = drive(Representation(kind=kind), u=u).y
    assert ((q[1:] * q[:-1]).sum(axis=1) > 0.9).all()
    assert q[0, 0] > 0.0


def test_a_quaternion_of_any_norm_will_do_but_not_zero() -> None:
    found = drive(Representation(kind="quaternion_to_dcm"), u=[3.0 * np.array(QUATERNION)]).y[0]
    assert found == pytest.approx(np.array(DCM), abs=1e-12)
    with pytest.raises(Exception, match="a quaternion of norm 0 is no rotation"):
        drive(Representation(kind="quaternion_to_dcm"), u=[[0.0, 0.0, 0.0, 0.0]])


def test_half_a_turn_has_a_quaternion() -> None:
    for axis in np.eye(3):
        q = quaternion_of_dcm(2.0 * np.outer(axis, axis) - np.eye(3))
        assert q == pytest.approx([0.0, *axis])
    assert quaternion_of_euler(np.array([0.0, 0.0, np.pi])) == pytest.approx([0.0, 0.0, 0.0, 1.0])
