"""A pendulum on a cart with LQR and a Kalman filter: a loop of three blocks, and numpy's loop beside it."""

from __future__ import annotations

from pathlib import Path

import control
import numpy as np
import pytest

from quadvis.api import load_text

A = [[0, 1, 0, 0], [0, -0.1, 2, 0], [0, 0, 0, 1], [0, -0.3, 25, 0]]
B = [[0], [1], [0], [2.5]]
MATRICES = (
    "A\n" + "\n".join(" ".join(map(str, row)) for row in A) + "\nB\n0\n1\n0\n2.5\nC\n1 0 0 0\n0 0 1 0\n"
)
LOOP = """\
quadvis: 1
name: pendulum
rates: {control: 100 Hz}
solver: {method: ode4, step: 1 ms}
stop_time: 4 s
blocks:
  plant:
    block: systems.state_space
    with: {file: pendulum.txt, initial: [0.2, 0, 0.1, 0], output_units: m rad}
    in: {u: {from: feedback.u, across: hold}}
  filter:
    block: systems.kalman
    rate: control
    with: {A: AD, B: BD, C: [[1, 0, 0, 0], [0, 0, 1, 0]], Q: Q_, R: [[1.0e-6, 0], [0, 1.0e-6]],
      output_units: m m/s rad rad/s}
    in: {y: {from: plant.y, across: sample}, u: feedback.u}
  feedback:
    block: systems.lqr
    rate: control
    with: {A: A_, B: [[0], [1], [0], [2.5]], Q: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 10, 0], [0, 0, 0, 1]],
      R: [[0.1]], model: sampled, output_units: N}
    in: {x: filter.x}
"""


def test_it_is_balanced_as_numpy_s_loop_is(tmp_path: Path) -> None:
    sampled = control.sample_system(control.ss(A, B, np.eye(4), np.zeros((4, 1))), 0.01)
    a, b, c, q, r = sampled.A, sampled.B, np.eye(4)[[0, 2]], 1e-6 * np.eye(4), 1e-6 * np.eye(2)
    text = LOOP.replace("AD", str(a.tolist())).replace("BD", str(b.tolist()))
    text = text.replace("A_", str(A)).replace("Q_", str(q.tolist()))
    (tmp_path / "pendulum.txt").write_text(MATRICES)
    result = load_text(text, tmp_path).run()

    gain = control.dlqr(a, b, np.diag([1.0, 1.0, 10.0, 1.0]), [[0.1]])[0]
    x, estimate, p = np.array([0.2, 0.0, 0.1, 0.0]), np.zeros(4), 1e6 * np.eye(4)
    found = []
    for _ in range(401):
        k = p @ c.T @ np.linalg.inv(c @ p @ c.T + r)
        estimate, left = estimate + k @ (c @ x - c @ estimate), np.eye(4) - k @ c
        p = left @ p @ left.T + k @ r @ k.T
        u = -gain @ estimate
        found.append(c @ x)
        x, estimate, p = a @ x + b @ u, a @ estimate + b @ u, a @ p @ a.T + q
    assert result["plant.y"][::10] == pytest.approx(np.array(found), abs=1e-6)
    assert np.abs(result["plant.y"][-1]).max() < 0.02
