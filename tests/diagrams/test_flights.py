"""Flights of references that move, and with a failsafe: a blackout, landings, take-overs, a hanging IMU."""

import functools
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from tests.stages import mostly_slow

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
MANUAL, AUTOMATIC, NEUTRAL = 0, 1, 2
IMU_STALE = 3
# What one microsecond of a radio channel of 1000 us moves: collective, and three torques.
LSB = np.array([4.0, 100.0, 100.0, 10.0]) / 1000


def fly(name: str, variant: str | None = None, seed: int = 1, **more: Any) -> Any:
    return whole_flight(name, variant, seed) if not more else flown(name, variant, seed, **more)


@functools.lru_cache(maxsize=4)  # some flights are looked at by several tests
def whole_flight(name: str, variant: str | None, seed: int) -> Any:
    return flown(name, variant, seed)


def flown(name: str, variant: str | None, seed: int, **more: Any) -> Any:
    return quadvis.load(DIAGRAMS / f"{name}.yaml", variant=variant, seed=seed, **more).run()


def jumps(result: Any) -> np.ndarray:
    """Return how much a control moved at each tick at which its source changed."""
    controls, source = result["control/switch.controls"], result["control/switch.source"]
    changed = source[1:] != source[:-1]
    assert changed.any()
    return np.abs(np.diff(controls, axis=0)) * changed


@pytest.mark.parametrize("variant", mostly_slow([None, "robust"], quick=0))
def test_a_take_over_meets_what_its_diagram_expects(variant: str | None) -> None:
    assert fly("takeover", variant).passed  # tests/test_readmes.py flies all the others in the second stage


def test_without_noise_and_wind_the_steps_are_those_of_the_paper_s_poles() -> None:
    quiet = {
        "craft/gust.rms": "{value: [0, 0, 0], unit: m/s}", "craft/imu.drift": "0 rad",
        "craft/imu.angle_noise": "0 rad", "craft/imu.rate_noise": "0 rad/s", "noise": "0 px",
    }  # fmt: skip
    result = fly("step", settings=quiet, stop_time=40)
    times, x = result.times("craft/body.position"), result["craft/body.position"][:, 0]
    elapsed = times[(times >= 10) & (times < 20)] - 10
    s = 2.0 * elapsed  # four poles at -2 rad/s; motors, radio and camera are what the tolerance is for
    left = np.exp(-s) * (1 + s + s**2 / 2 + s**3 / 6)
    assert x[(times >= 10) & (times < 20)] == pytest.approx(0.2 - 0.4 * left, abs=0.03)
    yaw = np.degrees(result["craft/body.attitude"][times >= 30, 2])
    s = times[times >= 30] - 30
    assert yaw == pytest.approx(30.0 * (1 - np.exp(-s) * (1 + s)), abs=2.0)


@pytest.mark.slow
def test_a_blackout_of_eight_seconds_ends_softly_on_the_ground() -> None:
    result = fly("landing", "blackout")
    assert result.passed
    assert result["craft/ground.impact"][-1] <= 0.35
    assert result["supervision/landing.landed"][-1]


@pytest.mark.parametrize("variant", mostly_slow([None, "robust"]))
def test_no_control_jumps_in_a_take_over_by_stick_or_by_switch(variant: str | None) -> None:
    found = jumps(fly("takeover", variant))
    assert found.max() == 0.0
    assert (np.round(found / LSB) == 0).all()


def test_the_pilots_stick_counts_within_one_tick_of_the_control() -> None:
    result = fly("takeover")
    times, stick = result.times("radio.y"), result["radio.y"][:, 1]
    taken = result["control/switch.source"][:, 1] == MANUAL
    assert times[np.argmax(taken)] == times[np.argmax(np.abs(stick) > 0.3)]


@pytest.mark.slow
def test_lost_vision_reaches_the_control_within_three_tenths_of_a_second() -> None:
    result = fly("blackout", stop_time=21)
    known = result["supervision/failsafe.velocity_weight"] == 0.0
    times = result.times("supervision/failsafe.velocity_weight")
    # The camera is blind from 20 s on; the last frame that gets through was taken before that.
    assert 20.0 < times[(times > 5.0) & known][0] <= 20.3


@pytest.mark.slow
def test_a_hanging_imu_hands_roll_and_pitch_to_nobody_and_back_without_a_jump(tmp_path: Path) -> None:
    text = re.sub("(parts|crafts)/", rf"{DIAGRAMS}/\1/", (DIAGRAMS / "takeover.yaml").read_text())
    gyro = "\n      rates: {from: craft.rates, across: sample}\n"
    assert text.count(gyro) == 2
    text = text.replace(gyro, "\n      rates: gyro.y\n").replace(
        "  setpoint:\n",
        "  gyro:\n    block: signal.outage\n    rate: control\n"
        "    with: {during: {value: [[5, 5.4]], unit: s}}\n"
        "    in: {u: {from: craft.rates, across: sample}}\n  setpoint:\n",
    )
    path = tmp_path / "hang.yaml"
    path.write_text(text)
    result = quadvis.load(path, stop_time=9).run()
    times, source = result.times("control/switch.source"), result["control/switch.source"]
    neutral = source[:, 1] == NEUTRAL
    assert times[np.argmax(neutral)] == pytest.approx(5.1)  # the last news is of 4.95 s
    assert (source[neutral] == [AUTOMATIC, NEUTRAL, NEUTRAL, AUTOMATIC]).all()
    assert (result["supervision/failsafe.reason"][neutral] == IMU_STALE).all()
    assert (source[times >= 5.4] == AUTOMATIC).all()
    assert jumps(result).max() == 0.0
    assert np.abs(result["craft/body.attitude"]).max() < 0.2


def test_a_lost_radio_neither_stops_the_law_nor_looks_like_a_stick_that_moves() -> None:
    result = fly("takeover")
    times = result.times("supervision/sticks.stale")
    stale = result["supervision/sticks.stale"]
    assert times[stale][0] == pytest.approx(32.5, abs=0.051) and times[stale][-1] < 34.0
    assert (result["control/switch.source"][stale] == AUTOMATIC).all()


def test_commands_that_nobody_renews_are_not_sent_for_long(tmp_path: Path) -> None:
    text = re.sub("(parts|crafts)/", rf"{DIAGRAMS}/\1/", (DIAGRAMS / "takeover.yaml").read_text())
    gate = "    in: {u: control.thrust, stamp: control.stamp}\n"
    assert text.count(gate) == 1
    text = text.replace(gate, gate.replace("control.stamp", "sender.y")).replace(
        "  gate:\n",
        "  sender:\n    block: signal.outage\n    rate: control\n"
        "    with: {during: {value: [[5, 5.2], [6, 6.5]], unit: s}}\n    in: {u: control.stamp}\n  gate:\n",
    )
    path = tmp_path / "silent.yaml"
    path.write_text(text)
    result = quadvis.load(path, stop_time=7).run()
    times, sent = result.times("gate.y"), result["gate.y"]
    idle = times[(sent == 0.0).all(axis=1)]
    assert idle == pytest.approx([6.25, 6.3, 6.35, 6.4, 6.45])  # the last command was made at 5.95 s


@pytest.mark.parametrize("seed", mostly_slow(range(1, 4), quick=0, slow=1))
def test_the_craft_outlasts_a_blackout_of_three_seconds_in_any_wind(seed: int) -> None:
    result = fly("blackout", seed=seed)
    times, position = result.times("craft/body.position"), result["craft/body.position"]
    dark = (times >= 20.0) & (times <= 23.0)
    assert np.abs(position[dark, :2]).max() <= 0.6
    assert result["supervision/vision.state"][-1] == 0
    assert result["supervision/failsafe.mode"][-1] == 2


@pytest.mark.parametrize("seed", mostly_slow(range(2, 4), quick=0, slow=1))
def test_the_better_design_outlasts_it_within_six_decimetres_of_its_target(seed: int) -> None:
    result = fly("blackout", "robust", seed=seed)
    assert result.passed
    assert result["excursion.y"].max() <= 0.6


@pytest.mark.parametrize("seed", mostly_slow(range(1, 3), quick=0, slow=1))
def test_half_the_frames_keep_the_better_design_in_the_air(seed: int) -> None:
    result = fly("blackout", "robust", seed=seed, settings={"eyes/camera.drop_rate": "0.5"})
    assert result["excursion.y"].max() <= 0.6
    assert result["supervision/failsafe.mode"].max() <= 3  # AUTOMATIC and COAST


@pytest.mark.parametrize("seed", mostly_slow([2, 7, 9], quick=0, slow=1))
def test_the_better_design_lands_after_eight_seconds_of_blackout_near_its_target(seed: int) -> None:
    result = fly("landing", "robust_blackout", seed=seed)
    assert result["craft/ground.impact"][-1] <= 0.35
    assert result["supervision/landing.landed"][-1]
    assert result["excursion.y"].max() <= 2.5  # seed 7 drifts 2.2 m


@pytest.mark.parametrize("seed", mostly_slow(range(2, 4), quick=0, slow=1))
@pytest.mark.parametrize("variant", [None, "blackout", "robust"])
def test_no_touch_down_is_harder_than_it_may_be(variant: str | None, seed: int) -> None:
    assert fly("landing", variant, seed)["craft/ground.impact"][-1] <= 0.35


@pytest.mark.parametrize("seed", mostly_slow(range(2, 4), quick=0, slow=1))
def test_a_take_over_jumps_in_no_wind(seed: int) -> None:
    result = fly("takeover", seed=seed)
    assert result.passed
    assert jumps(result).max() == 0.0


NO_FRAMES = {"eyes/camera.drop_rate": "1"}


@pytest.mark.slow
def test_a_camera_that_delivers_nothing_does_not_pass_the_hover_where_nothing_moves_the_craft_either() -> (
    None
):
    quiet = {"gust.rms": "{value: [0, 0, 0], unit: m/s}"}
    sets = [DIAGRAMS / "sets" / "sq.yaml"]
    result = fly("hover", "geometric", params=sets, settings=NO_FRAMES | quiet)
    assert not result.passed
    missed = [verdict.expectation.selection.text for verdict in result.outcome.verdicts if not verdict.met]
    assert missed == ["eyes/camera.fresh"]


@pytest.mark.parametrize("name", mostly_slow(["step", "takeover", "trajectory"], quick=0, slow=2))
def test_a_camera_that_loses_a_third_of_its_frames_passes_no_flight(name: str) -> None:
    result = fly(name, settings={"eyes/camera.drop_rate": "0.33"})
    missed = [verdict.expectation.selection.text for verdict in result.outcome.verdicts if not verdict.met]
    assert "eyes/camera.fresh" in missed
