import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.control.altitude import Altitude


def thrust(block: Altitude, **inputs: float) -> float:
    still = {"height": 1.0, "climb": 0.0, "roll": 0.0, "pitch": 0.0, "height_reference": 1.0}
    return float(drive(block, steps=1, **(still | inputs)).thrust[0])


def test_at_its_height_it_carries_the_weight() -> None:
    assert thrust(Altitude()) == pytest.approx(0.5 * 9.81)


def test_the_gains_follow_from_bandwidth_and_mass_as_a_force() -> None:
    # lambda 3, m 0.5: a1 = 3 N s/m, a2 = 4.5 N/m
    block = Altitude(bandwidth=3.0)
    assert thrust(block, climb=0.1) - thrust(block) == pytest.approx(-0.3)
    assert thrust(block, height=1.2) - thrust(block) == pytest.approx(-0.9)


def test_raw_gains_override_the_bandwidth() -> None:
    block = Altitude(gains=(1.5, 2.5))
    assert thrust(block, height=1.2, climb=0.1) - thrust(block) == pytest.approx(-0.15 - 0.5)


@given(st.floats(-0.7, 0.7), st.floats(-0.7, 0.7), st.floats(-1, 1), st.floats(-1, 1))
def test_the_vertical_force_does_not_depend_on_the_tilt(
    roll: float, pitch: float, error: float, climb: float
) -> None:
    inputs = {"height": 1.0 + error, "climb": climb}
    lifted = thrust(Altitude(), **inputs, roll=roll, pitch=pitch) * math.cos(roll) * math.cos(pitch)
    assert lifted == pytest.approx(thrust(Altitude(), **inputs))


def test_beyond_the_tilt_floor_the_thrust_grows_no_more() -> None:
    assert thrust(Altitude(), roll=1.5) == pytest.approx(2 * 0.5 * 9.81)
    assert thrust(Altitude(), roll=3.0) == pytest.approx(2 * 0.5 * 9.81)


def test_the_force_is_limited_but_not_the_weight() -> None:
    assert thrust(Altitude(force_limit=1.0), height=-50.0) == pytest.approx(4.905 + 1.0)
    assert thrust(Altitude(force_limit=1.0), height=50.0) == pytest.approx(4.905 - 1.0)


def test_references_and_feedforward_shift_the_balance() -> None:
    assert thrust(Altitude(), climb=0.2, climb_reference=0.2) == pytest.approx(4.905)
    assert thrust(Altitude(), feedforward=0.3) == pytest.approx(4.905 + 0.3)


def test_the_integral_grows_by_its_rate_times_the_error() -> None:
    block = Altitude(bandwidth=2.0, integral=0.5)
    result = drive(
        block, height=[1.1] * 5, climb=0.0, roll=0.0, pitch=0.0, height_reference=1.0, rate="10 Hz"
    )
    wanted = 4.905 - 0.5 * 4.0 * 0.1 * (1.0 + 0.5 * 0.1 * np.arange(5))
    assert result.thrust == pytest.approx(wanted)


LOOP = """
quadvis: 1
name: loop
rates: {control: 20 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 40 s
blocks:
  craft: {block: plant.rotorcraft, with: {mass: MASS kg}, in: {thrust: {from: mixer.thrust, across: hold}}}
  law:
    block: control.altitude
    rate: control
    with: {integral: INTEGRAL 1/s}
    in:
      height: {from: "craft.position[2]", across: sample}
      climb: {from: "craft.velocity[2]", across: sample}
      roll: 0 rad
      pitch: 0 rad
      height_reference: 0 m
  mixer:
    block: control.mixer
    rate: control
    in: {collective: law.thrust, roll: 0 rad/s^2, pitch: 0 rad/s^2, yaw: 0 rad/s^2}
"""


def held(mass: float, integral: float) -> float:
    """Return the height error in the end of a craft that weighs not what the law thinks."""
    text = LOOP.replace("MASS", f"{mass}").replace("INTEGRAL", f"{integral}")
    return float(load_text(text).run()["craft.position"][-1, 2])


@pytest.mark.slow
def test_with_an_integral_a_craft_of_another_mass_comes_to_its_height() -> None:
    assert held(0.6, 0.0) == pytest.approx(-0.1 * 9.81 / 0.5, rel=1e-3)  # d / a2
    assert held(0.6, 0.2) == pytest.approx(0.0, abs=5e-3)
    assert held(0.4, 0.2) == pytest.approx(0.0, abs=5e-3)


def test_the_integral_stands_still_at_the_limit_and_leaves_it_at_once() -> None:
    block = Altitude(integral=0.5, force_limit=1.0)
    errors = [-50.0] * 100 + [0.1]
    result = drive(block, height=errors, climb=0.0, roll=0.0, pitch=0.0, height_reference=0.0, rate="10 Hz")
    assert result.thrust[:100] == pytest.approx(np.full(100, 4.905 + 1.0))
    assert result.thrust[100] == pytest.approx(4.905 - 0.05)


def test_an_integral_faster_than_the_damping_is_refused() -> None:
    with pytest.raises(ParameterError, match="integral must be below 2 1/s, the damping, got 2 1/s"):
        Altitude(integral=2.0)


def test_one_gain_without_the_other_is_refused() -> None:
    with pytest.raises(ParameterError, match="gains must both be above 0, or both 0"):
        Altitude(gains=(1.0, 0.0))
