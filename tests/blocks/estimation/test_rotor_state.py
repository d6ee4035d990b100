import math

import numpy as np
import pytest

from quadvis.testing import drive
from quadvis_blocks.control.mixer import Mixer
from quadvis_blocks.estimation.rotor_state import RotorState
from quadvis_blocks.plant.rotorcraft import Rotorcraft
from quadvis_blocks.signal.transport_delay import TransportDelay

HOVER = np.full(4, 4.905 / 4)


def test_a_step_arrives_after_the_delay_and_rises_with_the_lag() -> None:
    result = drive(RotorState(delay=0.022, lag=0.08), thrust=HOVER + 0.1, rate="100 Hz", steps=60)
    since = np.maximum(result.time - 0.022, 0.0)
    assert result.collective == pytest.approx(4.905 + 0.4 * (1 - np.exp(-since / 0.08)), abs=1e-12)


def test_the_torque_is_the_mean_until_the_next_tick() -> None:
    thrust = HOVER + np.array([0.0, -0.1, 0.0, 0.1])
    result = drive(RotorState(delay=0.022, lag=0.08), thrust=thrust, rate="100 Hz", steps=30)
    fine = 0.01 * np.arange(29)[:, None] + 0.01 * (np.arange(2000) + 0.5) / 2000
    roll = 0.24 * 0.2 / 5e-3 * (1 - np.exp(-np.maximum(fine - 0.022, 0.0) / 0.08))
    assert result.torque[:29, 0] == pytest.approx(roll.mean(axis=1), abs=1e-6)
    assert result.torque[:, 1:] == pytest.approx(0.0, abs=1e-12)


def test_it_turns_as_the_simulated_craft_does_behind_its_radio() -> None:
    rng = np.random.default_rng(4)
    wanted = np.repeat(rng.normal(size=(20, 3)), 50, axis=0)  # 20 Hz, seen at 1 kHz
    thrust = drive(
        Mixer(), collective=np.full(1000, 4.905), roll=wanted[:, 0], pitch=wanted[:, 1], yaw=wanted[:, 2] / 4
    ).thrust
    sent = drive(TransportDelay(delay=0.022, initial=HOVER[0]), u=thrust, rate="1 kHz").y
    rates = drive(Rotorcraft(drag=0.0), thrust=sent, rate="1 kHz").rates
    torque = drive(RotorState(delay=0.022), thrust=thrust[::10], rate="100 Hz").torque
    assert np.cumsum(0.01 * torque, axis=0)[:-1] == pytest.approx(rates[10::10], abs=1e-9)


def test_the_weight_is_carried_before_any_command() -> None:
    result = drive(RotorState(mass=0.3, gravity=10.0, delay=0.5), thrust=np.ones(4), rate="100 Hz", steps=50)
    assert (result.collective == 3.0).all() and (result.torque == 0.0).all()


def test_many_commands_may_be_on_their_way() -> None:
    thrust = HOVER + np.random.default_rng(1).normal(0.0, 0.1, (200, 1)) * np.ones(4)
    late = drive(RotorState(delay=0.5), thrust=thrust, rate="100 Hz").collective
    prompt = drive(RotorState(delay=0.0), thrust=thrust, rate="100 Hz").collective
    assert late[50:] == pytest.approx(prompt[:-50], abs=1e-12)
    assert math.isfinite(late.sum())
