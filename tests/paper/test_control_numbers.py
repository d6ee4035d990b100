"""The numbers that follow from section 4 of the paper: closed forms and trajectories of its laws."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from quadvis.block import Block
from quadvis.engine.engine import Engine
from quadvis.graph.graph import Constant, Graph, Node, Task, Wire
from quadvis.testing import drive
from quadvis_blocks.control.altitude import Altitude
from quadvis_blocks.control.mixer import Mixer
from quadvis_blocks.control.nested_saturation import NestedSaturation
from quadvis_blocks.control.yaw import Yaw
from quadvis_blocks.plant.lateral import Lateral
from quadvis_blocks.plant.rotorcraft import Rotorcraft
from tests.stages import mostly_slow

GRAVITY = 9.81
LINEAR = (1e9, 1e9, 1e9, 1e9)  # amplitudes that never saturate


def closed_loop(law: NestedSaturation, plant: Lateral, step: Fraction, **disturbances: float) -> Engine:
    """The law on the ideal chain in continuous time: the solver evaluates both at every stage."""
    task = Task("continuous", step, continuous=True)
    wires: dict[str, Any] = {
        name: Wire("plant", name) for name in ("position", "velocity", "angle", "angular_rate")
    }
    for name, port in NestedSaturation.interface.inputs.items():
        if port.default is not None:
            wires[name] = Constant(disturbances.get(name, port.default))
    push = Constant(disturbances.get("acceleration", 0.0))
    nodes = [
        Node("plant", "lateral", plant, task, {"torque": Wire("law", "torque"), "acceleration": push}),
        Node("law", "nested_saturation", law, task, wires),
    ]
    return Engine(Graph("loop", nodes, "ode4", step))


def trajectory(engine: Engine, seconds: float) -> dict[str, np.ndarray]:
    """Every output of plant and law at every step, from 0 to the end, both included."""
    ports = [("plant", name) for name in Lateral.interface.outputs] + [("law", "torque")]
    rows: list[list[float]] = []
    engine.observe("continuous", lambda _: rows.append([engine.read(*port) for port in ports]))
    with engine:
        engine.run(round(seconds / engine.period) + 1)
    columns = np.array(rows).T
    result = {name: column for (_, name), column in zip(ports, columns, strict=True)}
    return result | {"time": np.arange(columns.shape[1]) * float(engine.period)}


def gains(bandwidth: float = 1.0, axis: str = "roll") -> list[float]:
    """The feedback of x1..x4 near the reference, torque = -k x."""
    law = NestedSaturation(bandwidth=bandwidth, gravity=1.0, axis=axis)
    sign = 1.0 if axis == "roll" else -1.0
    return [-torque_of(law, *(1e-3 * row * [sign, sign, 1.0, 1.0])) / 1e-3 for row in np.eye(4)]


def torque_of(law: Block, *chain: float) -> float:
    names = ("position", "velocity", "angle", "angular_rate")
    return float(drive(law, **dict(zip(names, chain, strict=True)), steps=1).torque[0])


@pytest.mark.parametrize(
    ("chain", "torques"),
    [
        ((0.1, 0, 0, 0), (-0.1, -0.76, -1.1875)),
        ((1, 0, 0, 0), (-0.19, -0.76, -1.1875)),
        ((0, 0.1, 0, 0), (-0.29, -1.56, -2.5)),
        ((0, 0, 0.1, 0), (-0.49, -1.96, -3.0625)),
        ((0, 0, 0, 0.1), (-0.4, -0.8, -1.0)),
        ((0.05, -0.02, 0.03, -0.04), (0.01, -0.56, -1.1375)),
        ((-3, 2, -0.5, 1.5), (-2, -5.6, -6.875)),
    ],
)
def test_the_law_gives_the_reference_torques_at_three_bandwidths(
    chain: tuple[float, ...], torques: tuple[float, ...]
) -> None:
    x1, x2, x3, x4 = chain
    for bandwidth, torque in zip((1.0, 2.0, 2.5), torques, strict=True):
        roll = NestedSaturation(bandwidth=bandwidth, gravity=1.0)
        pitch = NestedSaturation(bandwidth=bandwidth, gravity=1.0, axis="pitch")
        assert torque_of(roll, x1, x2, x3, x4) == pytest.approx(torque, abs=1e-12)
        assert torque_of(pitch, -x1, -x2, x3, x4) == pytest.approx(torque, abs=1e-12)


@pytest.mark.parametrize("axis", ["roll", "pitch"])
@pytest.mark.parametrize("bandwidth", [1.0, 2.0, 2.5])
def test_the_loop_has_four_poles_at_minus_the_bandwidth(bandwidth: float, axis: str) -> None:
    # The coefficients, not the roots: a fourfold root moves by 1e-4 for a rounding error.
    polynomial = [1.0, *reversed(gains(bandwidth, axis))]
    assert polynomial == pytest.approx(np.poly([-bandwidth] * 4), rel=1e-9)


@pytest.mark.parametrize(("bandwidth", "step"), [(1.0, Fraction(1, 50)), (2.5, Fraction(1, 100))])
def test_the_linear_response_is_the_closed_form(bandwidth: float, step: Fraction) -> None:
    law = NestedSaturation(bandwidth=bandwidth, amplitudes=LINEAR)
    result = trajectory(closed_loop(law, Lateral(initial_position=2.0), step), 12.0 / bandwidth)
    s = bandwidth * result["time"]
    expected = 2.0 * np.exp(-s) * (1 + s + s**2 / 2 + s**3 / 6)
    assert result["position"] == pytest.approx(expected, abs=1e-6)
    assert (np.diff(result["position"]) <= 0).all()  # no overshoot


def test_the_linear_response_has_the_reference_settling_times_and_peaks() -> None:
    law = NestedSaturation(bandwidth=1.0, amplitudes=LINEAR, gravity=1.0)
    result = trajectory(closed_loop(law, Lateral(initial_position=1.0, gravity=1.0), Fraction(1, 100)), 12.0)
    times = [np.interp(-share, -result["position"], result["time"]) for share in (0.5, 0.1, 0.05, 0.02, 0.01)]
    assert times == pytest.approx([3.6721, 6.6808, 7.7537, 9.0841, 10.0451], abs=1e-4)
    lowest = [result[name].min() for name in ("velocity", "angle", "angular_rate", "torque")]
    assert lowest == pytest.approx([-0.22404, -0.13060, -0.16818, -1.0], abs=2e-5)
    assert result["torque"].argmin() == 0


@pytest.mark.parametrize(
    ("bandwidth", "start", "tilt", "expected"),
    [
        (1.0, 5.0, "linear", (4.956502, 4.593678, 3.773580, 1.776917, 0.320887, 0.018854, 0.000028)),
        (2.0, 5.0, "linear", (4.898409, 4.371867, 3.563959, 1.736635, 0.091002, 0.000217, 0.0)),
        (2.0, 1.0, "linear", (0.899419, 0.497786, 0.184188, 0.013405, 0.000126)),
        (1.0, 5.0, "tangent", (4.956497, 4.593505, 3.772977, 1.776154, 0.320831)),
    ],
)
def test_saturated_trajectories_are_the_reference_ones(
    bandwidth: float, start: float, tilt: str, expected: tuple[float, ...]
) -> None:
    law, plant = NestedSaturation(bandwidth=bandwidth), Lateral(initial_position=start, tilt=tilt)
    times = (1, 2, 3, 5, 8, 12, 20)[: len(expected)]
    result = trajectory(closed_loop(law, plant, Fraction(1, 200)), times[-1])
    assert result["position"][[200 * time for time in times]] == pytest.approx(expected, abs=1e-5)


def test_pitch_flies_the_same_trajectory_as_roll() -> None:
    runs = [
        trajectory(
            closed_loop(
                NestedSaturation(axis=axis), Lateral(axis=axis, initial_position=5.0), Fraction(1, 50)
            ),
            8,
        )
        for axis in ("roll", "pitch")
    ]
    assert np.array_equal(runs[0]["position"], runs[1]["position"])
    assert np.array_equal(runs[0]["angle"], -runs[1]["angle"])


def test_far_away_it_cruises_at_the_speed_of_the_last_amplitude_and_leans_no_further_than_the_third() -> None:
    result = trajectory(
        closed_loop(NestedSaturation(bandwidth=1.0), Lateral(initial_position=100.0), Fraction(1, 50)), 90
    )
    assert np.abs(result["velocity"]).max() == pytest.approx(GRAVITY * 0.19, rel=1e-3)
    assert np.abs(result["angle"]).max() <= 0.4
    assert abs(result["position"][-1]) < 1e-3


@pytest.mark.parametrize("bandwidth", mostly_slow([1.0, 2.0]))
@pytest.mark.parametrize(
    ("name", "value", "share"),
    [
        (
            "angle_reference",
            -math.radians(0.3),
            6 * GRAVITY * -math.radians(0.3),
        ),  # measured angle 0.3 deg too big
        ("feedforward", 0.01, GRAVITY * 0.01),  # torque trim error
        ("acceleration", 0.04, 6 * 0.04),
    ],
)
def test_constant_errors_park_the_craft_where_the_closed_forms_say(
    bandwidth: float, name: str, value: float, share: float
) -> None:
    engine = closed_loop(NestedSaturation(bandwidth=bandwidth), Lateral(), Fraction(1, 50), **{name: value})
    power = 4 if name == "feedforward" else 2
    assert trajectory(engine, 60.0)["position"][-1] == pytest.approx(share / bandwidth**power, rel=0.01)


def test_the_offsets_are_the_centimetres_of_a_third_of_a_degree() -> None:
    engine = closed_loop(
        NestedSaturation(bandwidth=1.0), Lateral(), Fraction(1, 50), angle_reference=-math.radians(0.3)
    )
    assert trajectory(engine, 60.0)["position"][-1] == pytest.approx(-0.3082, abs=1e-4)


def test_the_loop_opened_at_the_torque_has_the_reference_margins() -> None:
    k1, k2, k3, k4 = gains()
    crossover, phase = margin([k4, k3, k2, k1], [1, 0, 0, 0, 0])
    assert crossover == pytest.approx(4.03, abs=0.005)
    assert math.degrees(phase) == pytest.approx(68.6, abs=0.1)
    assert phase / crossover == pytest.approx(0.297, abs=0.001)


def test_the_loop_opened_at_the_camera_has_the_reference_margins() -> None:
    k1, k2, k3, k4 = gains()
    crossover, phase = margin([k2, k1], [1, k4, k3, 0, 0])
    assert crossover == pytest.approx(0.69, abs=0.005)
    assert math.degrees(phase) == pytest.approx(43.55, abs=0.05)
    assert phase / crossover == pytest.approx(1.10, abs=0.005)


def margin(numerator: list[float], denominator: list[float]) -> tuple[float, float]:
    """Return crossover (rad/s) and phase margin (rad) of a loop whose gain falls through one once."""
    low, high = 1e-2, 1e2
    for _ in range(100):
        middle = math.sqrt(low * high)
        gain = abs(np.polyval(numerator, 1j * middle) / np.polyval(denominator, 1j * middle))
        low, high = (middle, high) if gain > 1 else (low, middle)
    response = np.polyval(numerator, 1j * low) / np.polyval(denominator, 1j * low)
    return low, float(np.angle(-response))


def test_a_camera_turned_by_more_than_the_phase_margin_makes_the_loop_unstable() -> None:
    # With x + iy as one complex position, a heading error turns the measured position and velocity.
    k1, k2, k3, k4 = gains()
    for degrees, stable in ((43.4, True), (43.7, False)):
        turn = np.exp(1j * math.radians(degrees))
        poles = np.roots([1, k4, k3, k2 * turn, k1 * turn])
        assert (poles.real.max() < 0) == stable


def test_the_motor_lag_limit_is_that_of_the_reference() -> None:
    for bandwidth in (1.0, 2.0):
        k1, k2, k3, k4 = gains(bandwidth)
        for lag, stable in ((0.568, True), (0.569, False)):
            poles = np.roots([lag / bandwidth, 1, k4, k3, k2, k1])
            assert (poles.real.max() < 0) == stable


def test_up_to_one_radian_the_tangent_leaves_the_angle_by_less_than_0_5574() -> None:
    # The paper prints 0.54, which holds up to 0.9927 rad only.
    def excess(angle: float) -> float:
        result = drive(
            Lateral(tilt="tangent", gravity=1.0, initial_angle=angle), torque=0.0, rate="1 Hz", steps=2
        )
        return float(result.velocity[-1]) - angle

    assert excess(1.0) == pytest.approx(0.5574, abs=5e-5)
    assert max(abs(excess(angle)) for angle in np.linspace(-1.0, 1.0, 41)) == excess(1.0)
    assert excess(0.9927) < 0.54 < excess(0.9928)


def test_the_mixer_and_the_rotorcraft_are_each_others_inverse() -> None:
    wanted = {"collective": 5.0, "roll": 3.0, "pitch": -2.0, "yaw": 0.7}
    thrust = drive(Mixer(), **wanted, steps=1).thrust[0]
    flight = drive(Rotorcraft(lag=1e-3, drag=0.0), thrust=thrust, rate="10 kHz", steps=1001)
    settled, after = flight.rates[100], flight.rates[1000]  # ten lags later the rotors turn at their commands
    assert (after - settled) / 0.09 == pytest.approx([3.0, -2.0, 0.7], abs=1e-3)
    assert thrust.sum() == pytest.approx(5.0, abs=1e-12)


def test_yaw_and_altitude_have_double_poles_and_park_by_their_stiffness() -> None:
    for bandwidth in (1.0, 2.0):
        yaw = [
            -float(drive(Yaw(bandwidth=bandwidth), angle=a, angular_rate=r, steps=1).torque[0]) / 1e-3
            for a, r in ((0.0, 1e-3), (1e-3, 0.0))
        ]
        assert [1.0, *yaw] == pytest.approx(np.poly([-bandwidth] * 2), rel=1e-9)
        level = {"roll": 0.0, "pitch": 0.0, "height_reference": 0.0}
        lift = [
            (
                0.5 * GRAVITY
                - drive(Altitude(bandwidth=bandwidth), height=h, climb=c, **level, steps=1).thrust[0]
            )
            / (0.5 * 1e-3)
            for h, c in ((0.0, 1e-3), (1e-3, 0.0))
        ]
        assert [1.0, *lift] == pytest.approx(np.poly([-bandwidth] * 2), rel=1e-9)
    # 0.025 rad/s^2 of trim error against a stiffness of 1: 1.43 deg
    assert math.degrees(0.025 / yaw_stiffness()) == pytest.approx(1.43, abs=0.005)


def yaw_stiffness() -> float:
    return -float(drive(Yaw(), angle=0.1, angular_rate=0.0, steps=1).torque[0]) / 0.1
