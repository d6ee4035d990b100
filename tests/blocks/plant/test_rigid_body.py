from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks._rotations import dcm_of_quaternion
from quadvis_blocks.plant.rigid_body import RigidBody

ZERO = [0.0, 0.0, 0.0]
INERTIA = np.array([0.02, 0.035, 0.05])
W = [
    [-0.6851620929268042, 3.9338171802122117, 0.47305267934294126],
    [-3.4100326238015235, 1.649823368765561, 2.1650240179167266],
]
Q = [
    [-0.41640467752741295, -0.01742878721641017, 0.8992986022489814, 0.132534546071901],
    [-0.563430779643703, 0.49334909102809515, -0.6374405768032846, -0.18116826978400866],
]


def run(block: RigidBody, steps: int, rate: str = "1 ms", **inputs: Any) -> Any:
    return drive(block, steps=steps, rate=rate, **inputs)


def test_free_tumbling_has_the_numbers_of_jacobi_s_functions() -> None:
    found = run(RigidBody(inertia=INERTIA, initial_rates=[0.1, 4.0, 0.2]), 2001)
    for k, (w, q) in enumerate(zip(W, Q, strict=True), 1):
        assert found.rates[1000 * k] == pytest.approx(w, abs=1e-6)
        attitude = found.attitude[1000 * k]
        assert attitude * np.sign(attitude @ q) == pytest.approx(q, abs=1e-6)
    energy = 0.5 * (INERTIA * found.rates**2).sum(axis=1)
    assert energy == pytest.approx(np.full(2001, 0.2811), rel=1e-7)
    momentum = [
        dcm_of_quaternion(q) @ (INERTIA * w) for q, w in zip(found.attitude, found.rates, strict=True)
    ]
    assert np.array(momentum) == pytest.approx(np.tile([0.002, 0.14, 0.01], (2001, 1)), abs=1e-7)
    assert np.abs(np.linalg.norm(found.attitude, axis=1) - 1.0).max() < 1e-9
    assert ((found.attitude[1:] * found.attitude[:-1]).sum(axis=1) > 0.0).all()


def test_under_forces_and_torques_it_is_scipy_s_solution() -> None:
    tensor = np.array([[0.3, 0.02, -0.01], [0.02, 0.2, 0.03], [-0.01, 0.03, 0.25]])
    force, torque, world = np.array([1.0, -2.0, 3.0]), np.array([0.1, 0.2, -0.1]), np.array([0.5, 0.0, -0.2])

    def rates(_: float, x: Any) -> Any:
        q, w = x[6:10], x[10:]
        dq = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        acceleration = (dcm_of_quaternion(q) @ force + world) / 2.0 + [0.0, 0.0, 9.81]
        return np.concatenate(
            [x[3:6], acceleration, dq, np.linalg.solve(tensor, torque - np.cross(w, tensor @ w))]
        )

    begin = np.array([1.0, 2.0, 3.0, -1.0, 0.0, 1.0, 0.6, 0.0, 0.8, 0.0, 0.3, -0.2, 0.5])
    wanted = solve_ivp(rates, (0.0, 1.0), begin, rtol=1e-11, atol=1e-12).y[:, -1]
    block = RigidBody(
        mass=2.0, inertia=np.diag(tensor), products=[0.02, -0.01, 0.03], gravity=[0.0, 0.0, 9.81],
        initial_position=begin[:3], initial_velocity=begin[3:6], initial_attitude=begin[6:10],
        initial_rates=begin[10:],
    )  # fmt: skip
    found = run(block, 501, "2 ms", force=force, torque=torque, world_force=world)
    at_end = np.concatenate([found.position[-1], found.velocity[-1], found.attitude[-1], found.rates[-1]])
    assert at_end == pytest.approx(wanted, abs=1e-8)


def test_a_throw_is_a_parabola() -> None:
    block = RigidBody(gravity=[0.0, 0.0, -9.81], initial_velocity=[2.0, 0.0, 5.0])
    found = run(block, 101, "10 ms")
    t = found.time
    assert found.position == pytest.approx(np.stack([2 * t, 0 * t, 5 * t - 4.905 * t * t], 1), abs=1e-12)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"products": [1.0, 0.0, 0.0]}, "products must leave the tensor positive definite"),
        (
            {"initial_attitude": [0.0, 0.0, 0.0, 0.0]},
            "initial_attitude must be a quaternion whose norm is not 0",
        ),
    ],
)
def test_a_body_that_cannot_be_is_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        RigidBody(**wrong)
