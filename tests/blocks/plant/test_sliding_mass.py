"""Tests of the block plant.sliding_mass: stick and slip against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.engine.engine import Engine
from quadvis.testing import drive
from quadvis_blocks.plant.sliding_mass import SlidingMass
from tests.quadvis.restored import check_repeats

# A mass on a spring, on a floor with dry friction.
SPRING = """\
quadvis: 1
name: spring
solver: {method: METHOD, step: 10 ms}
stop_time: 6 s
blocks:
  mass: {block: plant.sliding_mass, with: {mass: 2 kg, coulomb: 3 N, initial: START m}, in: {force: spring.y}}
  spring: {block: signal.gain, rate: continuous, with: {factor: -50 N/m}, in: {u: mass.x}}
"""
OMEGA, SHIFT = math.sqrt(50 / 2), 3 / 50  # rad/s; of the middle, by the friction (m)

# The same on a belt that takes it along until the spring tears it off.
BELT = """\
quadvis: 1
name: belt
solver: {method: ode4, step: 10 ms}
stop_time: 20 s
blocks:
  mass:
    block: plant.sliding_mass
    with: {mass: 2 kg, coulomb: 3 N, breakaway: 5 N, surface: 0.1 m/s, initial_speed: 0.1 m/s}
    in: {force: spring.y}
  spring: {block: signal.gain, rate: continuous, with: {factor: -50 N/m}, in: {u: mass.x}}
"""


def swung(start: float, time: float) -> tuple[float, float]:
    """Return where the mass is, and its speed: half a swing about a shifted middle after the other.

    Source: Marchewka, Abbott, Beichner, Oscillator damped by a constant-magnitude friction force, American
    Journal of Physics 72 (2004).
    """
    half = math.pi / OMEGA
    while abs(start) > SHIFT:
        middle = math.copysign(SHIFT, start)
        if time < half:
            angle = OMEGA * time
            return middle + (start - middle) * math.cos(angle), -(start - middle) * OMEGA * math.sin(angle)
        start, time = 2 * middle - start, time - half
    return start, 0.0


@pytest.mark.parametrize(("method", "error"), [("ode3", 3e-5), ("ode4", 2e-7)])
def test_a_mass_on_a_spring_loses_two_shifts_each_half_swing(method: str, error: float) -> None:
    result = load_text(SPRING.replace("METHOD", method).replace("START", "0.55")).run()
    truth = np.array([swung(0.55, time) for time in result.times("mass.x")])
    assert result["mass.x"] == pytest.approx(truth[:, 0], abs=error)
    assert result["mass.v"] == pytest.approx(truth[:, 1], abs=20 * error)


@pytest.mark.parametrize("start", [0.55, -0.55, 0.13, 0.059])
def test_it_comes_to_rest_and_stays_there_to_the_bit(start: float) -> None:
    result = load_text(SPRING.replace("METHOD", "ode4").replace("START", str(start))).run(keep=("*",))
    turns = max(0, math.ceil((abs(start) / SHIFT - 1) / 2))
    rest = result.times("mass.x") > turns * math.pi / OMEGA + 1e-9
    assert rest.sum() > 100
    assert not result["mass.v"][rest].any() and not result["mass.mode"][rest].any()
    assert result["mass.mode"][~rest][1:].all()
    assert np.ptp(result["mass.x"][rest]) == 0.0
    assert result["mass.x"][-1] == pytest.approx(swung(start, 100.0)[0], abs=1e-7)


def limit_cycle(time: float) -> tuple[float, float]:
    """Return where a mass on the belt is, and its speed, from the instant on at which it breaks away."""
    speed, middle, reach = 0.1, 3 / 50, (5 - 3) / 50
    slipping = 2 * (math.pi - math.atan(reach * OMEGA / speed)) / OMEGA
    sticking = 2 * reach / speed
    since = time % (slipping + sticking)
    if since > slipping:
        return middle - reach + speed * (since - slipping), speed
    sine, cosine = math.sin(OMEGA * since), math.cos(OMEGA * since)
    position = middle + reach * cosine + speed / OMEGA * sine
    return position, speed * cosine - reach * OMEGA * sine


def test_a_mass_on_a_belt_has_the_limit_cycle_of_the_closed_form() -> None:
    result = load_text(BELT).run(keep=("*",))
    first = 0.1 / 0.1  # it is taken along until the spring pulls with 5 N
    times = result.times("mass.x")
    late = times > first
    truth = np.array([limit_cycle(time - first) for time in times[late]])
    assert result["mass.x"][late] == pytest.approx(truth[:, 0], abs=1e-7)
    assert result["mass.v"][late] == pytest.approx(truth[:, 1], abs=2e-6)
    sticks = result["mass.mode"] == 0
    assert 0.3 < sticks[late].mean() < 0.9
    assert (result["mass.v"][sticks] == 0.1).all()
    assert set(result["mass.mode"].tolist()) == {0, -1}


def test_the_instants_are_located_to_a_part_of_a_step() -> None:
    """Thrown by 1.03 m/s and slowed by 1.5 m/s^2, it goes the way of the closed form, whatever the step."""
    found = drive(SlidingMass(mass=2.0, coulomb=3.0, initial_speed=1.03), force=np.zeros(20), rate="10 Hz")
    assert found.x[-1] == pytest.approx(1.03**2 / 3, abs=1e-12)
    assert not found.v[8:].any() and found.v[6] == pytest.approx(1.03 - 0.9, abs=1e-12)


def test_it_turns_round_without_a_rest_where_the_force_is_large() -> None:
    found = drive(SlidingMass(coulomb=1.0, initial_speed=1.03), force=np.full(12, -3.0), rate="10 Hz")
    turn = 1.03 / 4
    since = np.arange(12) / 10 - turn
    assert found.v == pytest.approx(np.where(since < 0, -4 * since, -2 * since), abs=1e-9)
    assert found.mode.tolist() == [1, 1, 1, *[-1] * 9]


def test_each_element_sticks_and_slips_for_itself() -> None:
    rows = np.array([[0.5, -2.0, 0.0]]).repeat(10, axis=0)
    block = SlidingMass(mass=[1.0, 2.0, 1.0], coulomb=[1.0, 1.0, 0.0], initial_speed=[0.0, 0.0, 0.3])
    found = drive(block, force=rows, rate="10 Hz")
    times = np.arange(10) / 10
    assert not found.x[:, 0].any()
    assert found.x[:, 1] == pytest.approx(-0.25 * times**2, abs=1e-12)
    assert found.x[:, 2] == pytest.approx(0.3 * times, abs=1e-12)


def test_without_friction_it_is_two_integrators() -> None:
    force = np.cos(np.arange(50) / 5)
    found = drive(SlidingMass(coulomb=0.0, viscous=0.0), force=force, rate="10 Hz")
    assert found.v == pytest.approx(np.append(0.0, np.cumsum(force)[:-1] / 10), abs=1e-12)


def test_a_restored_run_repeats_to_the_bit() -> None:
    check_repeats(Engine(load_text(BELT).graph), 90, 300)


def test_both_engines_give_the_same_bits() -> None:
    diagram = load_text(BELT)
    for name in ("mass.x", "mass.v"):
        assert diagram.run(engine="native")[name].tobytes() == diagram.run(engine="python")[name].tobytes()
