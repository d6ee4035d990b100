from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.io

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.state_space import StateSpace

RNG = np.random.default_rng(2)
A = [[0.0, 1.0, 0.0], [-4.0, -0.4, 0.5], [0.2, 0.0, -1.0]]
B = [[0.0, 0.1], [1.0, 0.0], [0.0, 2.0]]
C = [[1.0, 0.0, 0.5], [0.0, 1.0, 0.0]]
D = [[0.0, 0.3], [0.0, 0.0]]
U = RNG.normal(size=(60, 2))
CONTROLS = {"forward": "forward_diff", "backward": "backward_diff"}


@pytest.mark.parametrize("method", ["zoh", "tustin", "foh", "forward", "backward"])
def test_a_sampled_system_is_python_control_s(method: str) -> None:
    system = control.sample_system(control.ss(A, B, C, D), 0.05, method=CONTROLS.get(method, method))
    wanted = control.forced_response(system, 0.05 * np.arange(60), U.T).outputs.T
    found = drive(StateSpace(A=A, B=B, C=C, D=D, method=method), u=U, rate="20 Hz")
    assert found.y == pytest.approx(wanted, rel=1e-10, abs=1e-10)


def test_zero_order_hold_of_a_double_integrator_is_the_closed_form() -> None:
    block = StateSpace(A=[[0, 1], [0, 0]], B=[[0], [1]], C=[[1, 0]], method="zoh", period=0.1)
    assert block.a == pytest.approx(np.array([[1.0, 0.1], [0.0, 1.0]]), rel=1e-12)
    assert block.b == pytest.approx(np.array([[0.005], [0.1]]), rel=1e-12)


def test_from_an_initial_state_the_response_is_the_matrix_exponential() -> None:
    found = drive(
        StateSpace(A=A, B=B, C=C, D=D, initial=[1.0, -2.0, 0.5]), u=np.zeros((501, 2)), steps=501, rate="2 ms"
    )
    held = drive(
        StateSpace(A=A, B=B, C=C, D=D, initial=[1.0, -2.0, 0.5], method="zoh"),
        u=[0.0, 0.0],
        steps=501,
        rate="2 ms",
    )
    assert found.y == pytest.approx(held.y, abs=1e-10)


def test_one_output_is_a_scalar_and_one_input_may_be_one() -> None:
    block = StateSpace(A=[[-1.0]], B=[[2.0]], C=[[3.0]], D=[[0.5]], method="discrete")
    assert drive(block, u=[1.0, 0.0, 0.0]).y.tolist() == [0.5, 6.0, -6.0]
    assert drive(block, u=[[1.0], [0.0], [0.0]]).y.tolist() == [0.5, 6.0, -6.0]
    vector = StateSpace(A=[[-1.0]], B=[[2.0]], C=[[3.0], [1.0]], method="discrete")
    assert drive(vector, u=[1.0, 0.0]).y.tolist() == [[0.0, 0.0], [6.0, 2.0]]


def test_d_makes_direct_feedthrough() -> None:
    assert StateSpace(A=A, B=B, C=C, D=D).interface.feedthrough == {"u"}
    assert not StateSpace(A=A, B=B, C=C).interface.feedthrough
    assert StateSpace(A=A, B=B, C=C, method="tustin").interface.feedthrough == {"u"}


def test_a_system_of_python_control_becomes_a_block() -> None:
    system = control.ss(A, B, C, D)
    wanted = drive(StateSpace(A=A, B=B, C=C, D=D, method="zoh"), u=U, rate="20 Hz").y
    assert np.array_equal(drive(StateSpace.of(system, method="zoh"), u=U, rate="20 Hz").y, wanted)
    sampled = StateSpace.of(control.sample_system(system, 0.05))
    assert drive(sampled, u=U, rate="20 Hz").y == pytest.approx(wanted, rel=1e-10, abs=1e-12)
    assert StateSpace.of(control.ss([], [], [], [[2.0]])).D.tolist() == [[2.0]]
    assert StateSpace.of(control.tf([1.0], [1.0, 2.0])).A.tolist() == [[-2.0]]


def _written(folder: Path, kind: str) -> str:
    path = folder / f"plant.{kind}"
    matrices = {"A": [[0.0, 1.0], [0.0, -0.1]], "B": [[0.0], [0.5]], "C": [[1.0, 0.0], [0.0, 1.0]]}
    if kind == "npz":
        np.savez(path, **{name: np.array(value) for name, value in matrices.items()})
    elif kind == "mat":
        scipy.io.savemat(path, matrices)
    elif kind == "yaml":
        path.write_text("".join(f"{name}: {value}\n" for name, value in matrices.items()))
    else:
        path.write_text("A\n0 1\n0 -0.1\nB\n0\n0.5\nC\n1 0\n0 1\n")
    return path.name


@pytest.mark.parametrize("kind", ["npz", "mat", "yaml", "csv"])
def test_the_matrices_may_stand_in_a_file(kind: str, tmp_path: Path) -> None:
    text = f"""quadvis: 1
name: cart
solver: {{method: ode4, step: 10 ms}}
stop_time: 1 s
blocks:
  cart:
    block: systems.state_space
    with: {{file: {_written(tmp_path, kind)}, output_units: m m/s}}
    in: {{u: 2 N}}
"""
    diagram = load_text(text, tmp_path)
    speed = 10.0 * (1.0 - np.exp(-0.1))
    assert diagram.run()["cart.y"][-1] == pytest.approx([10.0 * (1.0 - speed), speed], abs=1e-9)


def test_a_sampled_system_in_a_file_keeps_its_sample_time(tmp_path: Path) -> None:
    path = tmp_path / "g.yaml"
    path.write_text("A: [[0.5]]\nB: [[1]]\nC: [[1]]\ndt: 0.1\n")
    assert drive(StateSpace(file=str(path), method="discrete"), u=[1.0, 0.0], rate="10 Hz").y.tolist() == [
        0.0,
        1.0,
    ]
    with pytest.raises(
        ParameterError, match="method must be discrete, since the file has a system that is sampled"
    ):
        StateSpace(file=str(path))
    with pytest.raises(ParameterError, match=r"sampled every 0.2 s, as the block is, got 0\.1 s"):
        StateSpace(file=str(path), method="discrete", period=0.2)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"A": [[0, 1], [0, 0]], "B": [[1]], "C": [[1, 0]]}, "B must be 2 x 1, got 1 x 1"),
        ({"A": [[0]], "B": [[1]], "C": [[1, 0]]}, "C must be 1 x 1, got 1 x 2"),
        ({"A": A, "B": B, "C": C, "D": [[1.0]]}, "D must be 2 x 2, got 1 x 1"),
        ({"A": A, "B": B, "C": C, "initial": [1.0, 2.0]}, "initial must be 3 values, got 2"),
        ({"A": A, "B": B, "C": C, "output_units": "m m m"}, "output_units must be 2 units, or one for all"),
        ({"A": A, "B": B, "C": C, "output_units": "metres"}, "output_units must be units such as"),
        ({"A": A, "B": B, "C": C, "method": "matched"}, "use systems.zero_pole_gain"),
    ],
)
def test_what_is_no_system_is_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        StateSpace(**wrong)
