"""Betaflight's own firmware flies the craft from the ground to the ground, and into its own failsafe."""

from __future__ import annotations

import fcntl
import shutil
import tempfile
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis_blocks.firmware._connection import FirmwareError
from quadvis_blocks.firmware._session import program
from quadvis_blocks.firmware.betaflight import _own_settings
from tests.diagrams.golden import DIAGRAMS
from tests.processes import linux

FLIGHT = DIAGRAMS / "betaflight.yaml"
WAIT, SPIN, CLIMB, STAY, LAND, STAND, END = range(7)
TOGETHER = 1.5  # by how much the gains may differ from those of the hover


def missing() -> str:
    """Return why Betaflight cannot fly here; "" if it can."""
    try:
        program("")
    except FirmwareError as error:
        return str(error)
    return "" if shutil.which("gcc") else "the clock of the firmware needs gcc"


flies = pytest.mark.skipif(bool(missing()), reason=missing())


@pytest.fixture
def turn() -> Iterator[None]:
    """Wait for the firmware's ports, which one flight on a machine can have: tests may run side by side."""
    with Path(tempfile.gettempdir(), "quadvis-betaflight-tests.lock").open("w") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def begins(result: Any, signal: str, value: Any = True) -> float:
    """Return the time (s) at which a signal has a value first."""
    found = result[signal] == value
    assert found.any(), f"{signal} is never {value}"
    return float(result.times(signal)[np.argmax(found)])


def test_the_gains_are_those_of_the_hover_within_their_bounds() -> None:
    """The laws ask for angles in place of torques, by the same bandwidths, amplitudes and limits."""
    hover, flight = quadvis.load(DIAGRAMS / "hover.yaml", variant="robust").graph, quadvis.load(FLIGHT).graph
    for law in ("roll", "pitch", "yaw", "altitude"):
        ours, theirs = flight[f"control/{law}"].block, hover[f"control/{law}"].block
        assert 1 / TOGETHER <= ours.bandwidth / theirs.bandwidth <= TOGETHER, law
        if law in ("roll", "pitch"):
            assert tuple(ours.amplitudes) == tuple(theirs.amplitudes)[2:]


def test_a_step_of_the_firmware_is_one_of_its_control_loops_and_of_the_craft() -> None:
    diagram = quadvis.load(FLIGHT)
    controller, body = (diagram.graph[path].block for path in ("controller", "craft/body"))
    assert controller.period == 1e-3 and "set pid_process_denom = 8" in str(_own_settings(1e-3))
    assert diagram.graph.tick == Fraction(1, 1000)
    assert body.interface.params["model"].choices[body.model] == "rigid_body"


@linux
@flies
@pytest.mark.slow
def test_it_arms_takes_off_hovers_for_a_minute_lands_and_disarms(turn: None, tmp_path: Path) -> None:
    result = quadvis.load(FLIGHT).run(log=tmp_path / "flight.mcap")
    assert result.passed, [str(verdict) for verdict in result.outcome.verdicts if not verdict.met]
    assert (np.diff(result["sortie.phase"]) >= 0).all()
    assert set(result["sortie.phase"]) == set(range(7))
    assert begins(result, "sortie.phase", LAND) - begins(result, "sortie.phase", STAY) >= 60.0
    armed, times = result["controller.armed"], result.times("controller.armed")
    assert begins(result, "sortie.phase", SPIN) < begins(result, "controller.armed") < 3.0
    assert times[armed][-1] - begins(result, "sortie.phase", END) < 0.5
    turning = times[result["controller.motors"].any(axis=1)]
    assert begins(result, "sortie.phase", SPIN) < turning[0] and turning[-1] < times[armed][-1] + 0.1


@linux
@flies
@pytest.mark.slow
def test_without_a_radio_its_own_failsafe_sinks_and_stops(turn: None, tmp_path: Path) -> None:
    result = quadvis.load(FLIGHT, variant="failsafe", stop_time="40 s").run(log=tmp_path / "failsafe.mcap")
    assert result.passed, [str(verdict) for verdict in result.outcome.verdicts if not verdict.met]
    assert begins(result, "radio.ok", value=False) == pytest.approx(20.0)
    # The settings keep the sticks for 1 s; the receiver finds its signal lost some milliseconds later.
    assert 21.0 <= begins(result, "controller.failsafe") <= 21.3
    times, height = result.times("craft/body.position"), result["craft/body.position"][:, 2]
    assert height[(times > 20.0) & (times < 21.0)] == pytest.approx(1.5, abs=0.1)
    assert times[height > 0.1][-1] < 26.0


@linux
@flies
@pytest.mark.slow
@pytest.mark.parametrize(
    "settings",
    [
        pytest.param({"craft/motors.order": [1, 2, 3, 4]}, id="motors_in_another_order"),
        pytest.param({"pose.side": "1.2 m"}, id="a_target_that_is_smaller_than_believed"),
    ],
)
def test_a_flight_that_goes_wrong_is_found(turn: None, settings: dict[str, Any]) -> None:
    """It is judged up to 14 s, of which 5 s are of the hover; or the firmware stops it by itself."""
    try:
        result = quadvis.load(FLIGHT, settings=settings, stop_time="14 s").run(keep=["craft/*"])
    except quadvis.errors.RunError as error:
        assert "Betaflight" in str(error)
        return
    assert not all(verdict.met for verdict in result.outcome.verdicts if "after 80 s" not in str(verdict))
