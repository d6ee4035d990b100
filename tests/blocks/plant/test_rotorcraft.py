import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.block import ParameterError
from quadvis.testing import Driven, drive
from quadvis_blocks.plant.rotorcraft import Rotorcraft

HOVER = np.full(4, 0.5 * 9.81 / 4)
BOTH = pytest.mark.parametrize("model", ["paper", "rigid_body"])
angles = st.tuples(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), st.floats(-3.0, 3.0))


def fly(
    thrust: Any = HOVER, seconds: float = 1.0, rate: int = 200, wind: Any = (0, 0, 0),
    force: Any = (0, 0, 0), torque: Any = (0, 0, 0), **parameters: Any,
) -> Driven:  # fmt: skip
    return drive(
        Rotorcraft(**parameters), thrust=thrust, wind=wind, force=force, torque=torque,
        rate=f"{rate} Hz", steps=round(seconds * rate) + 1,
    )  # fmt: skip


def rotation(roll: float, pitch: float, yaw: float) -> np.ndarray:
    """Body to north-east-down: Rz(yaw) Ry(pitch) Rx(roll)."""
    cr, sr, cp, sp, cy, sy = (f(a) for a in (roll, pitch, yaw) for f in (math.cos, math.sin))
    x = np.array([[1, 0, 0], [0, cr, -sr], [0, sr, cr]])
    y = np.array([[cp, 0, sp], [0, 1, 0], [-sp, 0, cp]])
    return np.array([[cy, -sy, 0], [sy, cy, 0], [0, 0, 1]]) @ y @ x


@BOTH
def test_it_hovers_where_it_starts(model: str) -> None:
    result = fly(model=model, initial_position=(1.0, -2.0, 3.0), seconds=5.0)
    assert np.abs(result.position - [1.0, -2.0, 3.0]).max() < 1e-12
    assert np.abs(result.attitude).max() < 1e-12


@given(angles)
def test_the_paper_model_accelerates_by_equations_11_to_13(attitude: tuple[float, float, float]) -> None:
    roll, pitch, _ = attitude
    result = fly(initial_attitude=attitude, drag=0.0, seconds=0.5)
    u = 0.5 * 9.81
    acceleration = np.array([
        -u * math.sin(pitch), u * math.cos(pitch) * math.sin(roll), u * math.cos(pitch) * math.cos(roll) - u
    ]) / 0.5  # fmt: skip
    assert result.velocity[-1] == pytest.approx(0.5 * acceleration, abs=1e-9)
    assert result.position[-1] == pytest.approx(0.125 * acceleration, abs=1e-9)


@given(angles)
def test_the_rigid_body_accelerates_along_its_rotated_axis(attitude: tuple[float, float, float]) -> None:
    result = fly(model="rigid_body", initial_attitude=attitude, drag=0.0, seconds=0.5)
    north, east, down = rotation(*attitude) @ [0.0, 0.0, -9.81] + [0.0, 0.0, 9.81]
    assert result.velocity[-1] == pytest.approx(0.5 * np.array([north, east, -down]), abs=1e-9)


@BOTH
def test_signs_nose_up_goes_back_right_side_down_goes_right(model: str) -> None:
    back = fly(model=model, initial_attitude=(0.0, 0.1, 0.0)).velocity[-1]
    right = fly(model=model, initial_attitude=(0.1, 0.0, 0.0)).velocity[-1]
    assert back[0] < -0.5 and abs(back[1]) < 1e-9
    assert right[1] > 0.5 and abs(right[0]) < 1e-9


@BOTH
def test_rotors_give_the_share_of_their_commands_that_the_scale_says(model: str) -> None:
    weak = fly(model=model, thrust_scale=(0.9,) * 4, lag=1e-3, drag=0.0, rate=2000)
    assert weak.velocity[-1, 2] == pytest.approx(-0.1 * 9.81 * (1.0 - 1e-3), rel=1e-3)
    crooked = fly(model=model, thrust_scale=(1.0, 1.0, 1.0, 1.1), lag=1e-3, rate=2000, seconds=0.1)
    torque = 0.24 * 0.1 * HOVER[3] / 5e-3
    assert crooked.rates[-1, 0] == pytest.approx(torque * (0.1 - 1e-3), rel=1e-2)


@BOTH
def test_another_force_accelerates_it_by_its_mass_and_another_torque_by_its_inertia(model: str) -> None:
    pulled = fly(model=model, drag=0.0, force=[0.1, -0.2, 0.3])
    assert pulled.velocity[-1] == pytest.approx([0.2, -0.4, 0.6], abs=1e-9)
    for axis, inertia in enumerate((5e-3, 5e-3, 9e-3)):
        turned = fly(model=model, torque=1e-3 * np.eye(3)[axis])
        assert turned.rates[-1] == pytest.approx(1e-3 / inertia * np.eye(3)[axis], abs=1e-9)


@BOTH
@pytest.mark.parametrize(
    ("change", "axis", "acceleration"),
    [
        ((0, -0.01, 0, 0.01), 0, 0.24 * 0.02 / 5e-3),
        ((0.01, 0, -0.01, 0), 1, 0.24 * 0.02 / 5e-3),
        ((0.01, -0.01, 0.01, -0.01), 2, 0.016 * 0.04 / 9e-3),
    ],
)
def test_rotors_turn_it_as_in_section_3_after_their_lag(
    model: str, change: tuple[float, ...], axis: int, acceleration: float
) -> None:
    result = fly(HOVER + change, model=model, seconds=0.4)
    time = result.time
    lagged = acceleration * (time - 0.08 * (1.0 - np.exp(-time / 0.08)))
    assert result.rates[:, axis] == pytest.approx(lagged, abs=1e-6)
    assert np.abs(np.delete(result.rates, axis, 1)).max() < 1e-12


def test_the_climb_follows_the_thrust_with_the_motor_lag() -> None:
    result = fly(HOVER + 0.1, drag=0.0, lag=0.1)
    lagged = 0.4 / 0.5 * (result.time - 0.1 * (1.0 - np.exp(-result.time / 0.1)))
    assert result.velocity[:, 2] == pytest.approx(lagged, abs=1e-6)


def test_commands_beyond_the_limits_give_the_limits() -> None:
    result = fly([9.0, -5.0, 1.0, 1.0], seconds=2.0)
    assert result.state("front") == pytest.approx(2.0, abs=1e-9)
    assert result.state("right") == pytest.approx(0.0, abs=1e-9)


def test_drag_slows_it_down_and_wind_carries_it_along() -> None:
    slowing = fly(initial_velocity=(1.0, -2.0, 0.5), seconds=3.0)
    assert slowing.velocity[-1] == pytest.approx(np.array([1.0, -2.0, 0.5]) * math.exp(-0.6), abs=1e-9)
    carried = fly(wind=[1.0, -2.0, 0.5], seconds=3.0)
    assert carried.velocity[-1] == pytest.approx(
        np.array([1.0, -2.0, 0.5]) * (1.0 - math.exp(-0.6)), abs=1e-9
    )


def test_a_trim_error_is_an_angular_acceleration() -> None:
    result = fly(torque_bias=(0.1, -0.2, 0.3), seconds=0.5)
    assert result.rates[-1] == pytest.approx([0.05, -0.1, 0.15])
    assert result.attitude[-1] == pytest.approx([0.0125, -0.025, 0.0375])


def test_trim_errors_of_random_sign_have_their_size_and_every_pattern_of_signs_comes() -> None:
    def rates(seed: int) -> Any:
        craft = Rotorcraft(torque_bias=(0.1, 0.2, 0.3), bias_sign="random")
        return drive(craft, thrust=HOVER, rate="10 Hz", steps=2, seed=seed).rates[-1]

    found = np.array([rates(seed) for seed in range(100)])
    assert np.abs(found) == pytest.approx(np.tile([0.01, 0.02, 0.03], (100, 1)))
    assert np.array_equal(rates(7), rates(7))
    assert len({tuple(row) for row in np.sign(found)}) == 8
    assert np.abs(np.sign(found).mean(axis=0)).max() < 4 / 10


def test_a_rigid_body_turned_about_a_fixed_axis_ends_where_the_rotation_matrix_says() -> None:
    bias = np.array([0.6, -0.9, 1.2])
    result = fly(
        model="rigid_body", inertia=(5e-3, 5e-3, 5e-3), torque_bias=bias, initial_attitude=(0.3, 0.2, 2.0)
    )
    angle = 0.5 * np.linalg.norm(bias)  # after one second
    x, y, z = bias / np.linalg.norm(bias)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    turn = np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross
    assert rotation(*result.attitude[-1]) == pytest.approx(rotation(0.3, 0.2, 2.0) @ turn, abs=1e-8)


def test_without_torque_a_rigid_body_keeps_energy_and_angular_momentum() -> None:
    inertia = np.array([4e-3, 5e-3, 9e-3])
    commands = np.tile(HOVER, (800, 1))
    commands[:60] += [0.02, -0.03, -0.02, 0.01]
    commands[:60] += [0.4, -0.4, 0.4, -0.4]
    result = fly(commands, model="rigid_body", inertia=inertia, seconds=799 / 200)
    momentum = inertia * result.rates[400:]  # the rotors have come to rest: 21 time constants
    energy = (momentum * result.rates[400:]).sum(axis=1)
    assert np.ptp(result.rates[400:, 0]) > 0.05
    assert np.linalg.norm(momentum, axis=1) == pytest.approx(np.linalg.norm(momentum[0]), rel=1e-6)
    assert energy == pytest.approx(energy[0], rel=1e-6)


def test_for_small_tilts_both_models_agree() -> None:
    attitude = (0.01, -0.02, 0.0)
    paper, rigid = (fly(model=model, initial_attitude=attitude) for model in ("paper", "rigid_body"))
    assert paper.position[-1] == pytest.approx(rigid.position[-1], abs=1e-4)


@BOTH
def test_yaw_is_wrapped_at_the_output_and_goes_on_inside(model: str) -> None:
    result = fly(model=model, torque_bias=(0.0, 0.0, 2.0), seconds=4.0)
    expected = result.time**2
    assert expected[-1] > 5 * math.pi
    yaw = result.attitude[:, 2]
    assert (yaw > -math.pi).all() and (yaw <= math.pi).all()
    assert np.exp(1j * yaw) == pytest.approx(np.exp(1j * expected), abs=1e-9)
    assert result.state("yaw") > 5 * math.pi


@pytest.mark.parametrize(
    ("wrong", "sentence"),
    [
        ({"mass": 0.0}, "mass must be above 0 kg, got 0 kg"),
        ({"model": "papr"}, "model must be one of paper, rigid_body, got 'papr'; did you mean 'paper'"),
        ({"thrust_min": 3.0}, "thrust_min must be below thrust_max, 2 N, got 3 N"),
    ],
)
def test_a_craft_that_cannot_be_is_refused(wrong: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ParameterError, match=sentence):
        Rotorcraft(**wrong)
