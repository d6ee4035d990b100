"""A run in real time, in which one computer sends the lines of a protocol to another one."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.cli import main

pytestmark = [pytest.mark.slow, pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")]

LAB = Path(__file__).parents[3] / "diagrams" / "protocols" / "lab_imu.yaml"
SAFE = 1.0
TEXT = """\
quadvis: 1
name: lines
rates: {imu: 100 Hz, control: 50 Hz}
stop_time: 1 s
overload: {action: warn}
computers: {world: {}, target: {}}
blocks:
  tilt: {block: sources.sine, rate: imu, at: world, with: {amplitude: 0.3 rad, frequency: 1 Hz}}
  still: {block: sources.constant, rate: imu, at: world, with: {value: {value: [0, 0, 0.5], unit: rad/s}}}
  unit:
    block: hardware.message_out
    rate: imu
    at: world
    with:
      port: PORT
      protocol: LAB
      spacing: 10 ms
      initial_roll: 0
      safe_roll: SAFE rad
      initial_pitch: 0
      safe_pitch: 0
      initial_rates: {value: [0, 0, 0], unit: rad/s}
      safe_rates: {value: [0, 0, 0], unit: rad/s}
    in: {roll: tilt.y, pitch: 0.25 rad, rates: still.y}
  imu: {block: hardware.message_in, rate: control, at: target, with: {port: BACK, protocol: LAB}}
log: {signals: [imu, unit]}
"""


@pytest.mark.parametrize(
    ("port", "back"),
    [
        ("pty:imu", "pty:imu"),
        ("udp:127.0.0.1:45811", "udp::45811"),
    ],
)
def test_what_one_computer_sends_the_other_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, port: str, back: str
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("lines.yaml").write_text(
        TEXT.replace("SAFE", str(SAFE))
        .replace("PORT", f'"{port}"')
        .replace("BACK", f'"{back}"')
        .replace("LAB", str(LAB))
    )
    assert main(["check", "lines.yaml"]) == 0
    result = quadvis.load("lines.yaml").run(real_time=quadvis.RealTime(priority=0, poll="0 s"))
    seen = result["imu.age"] >= 0
    assert seen.sum() > 10
    assert result["imu.refused"].max() == 0 and result["imu.others"].max() == 0
    assert set(result["imu.pitch"][seen]) <= {0.0, 0.25}
    sent = {0.0, *np.round(result["unit.sent_roll"], 6)}
    assert result.flight is not None
    if any(task.overruns for share in result.flight.shares for task in share.tasks):
        sent.add(SAFE)  # what the guardian sends while a loop is held up
    assert {*np.round(result["imu.roll"][seen], 6)} <= sent
    assert len({*result["imu.roll"][seen]}) > 10
    np.testing.assert_array_equal(result["imu.rates"][-1], [0.0, 0.0, 0.5])
