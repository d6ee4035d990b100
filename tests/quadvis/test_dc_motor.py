"""A DC motor with a PI controller, as a newcomer writes it: few blocks, SI units, against the exact plant."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import expm

import quadvis

MOTOR = """\
quadvis: 1
name: DC motor
params: {R: 1 ohm, L: 0.5 H, J: 0.01 kg*m^2, b: 0.1 N*m*s, K: 0.01 N*m/A, kp: 100 V*s, ki: 200 V, fs: 100 Hz}
rates: {control: $fs}
solver: {step: 1/(10*$fs)}
stop_time: 5 s
blocks:
  ref: {block: sources.step, rate: control, with: {after: 1 rad/s, at: 0.5 s}}
  error: {block: signal.difference, rate: control, in: {plus: ref.y, minus: {from: speed.y, across: sample}}}
  integral: {block: signal.discrete_integrator, rate: control, in: {u: error.y}}
  law:
    block: math.expression
    rate: control
    with: {v: kp * e + ki * s, kp: $kp, ki: $ki}
    in: {e: error.y, s: integral.y}
  coil:
    block: math.expression
    rate: continuous
    with: {slope: (v - R * i - K * w) / L, R: $R, K: $K, L: $L}
    in: {v: {from: law.v, across: hold}, i: current.y, w: speed.y}
  current: {block: signal.integrator, in: {u: coil.slope}}
  rotor:
    block: math.expression
    rate: continuous
    with: {slope: (K * i - b * w) / J, K: $K, b: $b, J: $J}
    in: {i: current.y, w: speed.y}
  speed: {block: signal.integrator, in: {u: rotor.slope}}
"""


def exact(fs: float) -> np.ndarray:
    """Return the speed (rad/s) at the ticks, with the plant discretised exactly."""
    r, inductance, j, b, k, kp, ki = 1.0, 0.5, 0.01, 0.1, 0.01, 100.0, 200.0
    a = np.array([[-r / inductance, -k / inductance, 1 / inductance], [k / j, -b / j, 0], [0, 0, 0]])
    step = expm(a / fs)
    x, total, found = np.zeros(2), 0.0, []
    for tick in range(int(5 * fs) + 1):
        found.append(x[1])
        error = (1.0 if tick >= 0.5 * fs else 0.0) - x[1]
        x = (step @ [*x, kp * error + ki * total])[:2]
        total += error / fs
    return np.array(found)


@pytest.mark.parametrize("fs", [100, 50])
def test_the_motor_runs_at_first_try(fs: int, tmp_path: Path) -> None:
    path = tmp_path / "motor.yaml"
    path.write_text(MOTOR)
    diagram = quadvis.load(path, settings={"fs": f"{fs} Hz"})
    assert not diagram.warnings
    assert len(diagram.graph.nodes) <= 8
    assert len(MOTOR.splitlines()) <= 40
    speed = diagram.run()["speed.y"][::10]
    assert speed == pytest.approx(exact(fs), abs=1e-6)
