from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.lqr import Lqr

DOUBLE: dict[str, Any] = {"A": [[0, 1], [0, 0]], "B": [[0], [1]], "Q": [[1, 0], [0, 1]], "R": [[1]]}
CART: dict[str, Any] = {
    "A": [[0, 1, 0, 0], [0, -0.1, 2, 0], [0, 0, 0, 1], [0, -0.3, 25, 0]],
    "B": [[0], [1], [0], [2.5]],
    "Q": np.diag([1.0, 1.0, 10.0, 1.0]).tolist(),
    "R": [[0.1]],
}
K_CART = [[-3.1622776601683795, -6.043524822869522, 40.756085721515994, 8.93877558856216]]


def test_the_gains_are_those_of_the_matrix_sign_function() -> None:
    assert Lqr(**DOUBLE).gain == pytest.approx(np.array([[1.0, 1.7320508075688772]]), rel=1e-8)
    assert Lqr(**CART).gain == pytest.approx(np.array(K_CART), rel=1e-8)


def test_the_gains_are_python_control_s() -> None:
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(4, 4)), rng.normal(size=(4, 2))
    q, r = np.diag([1.0, 0.0, 2.0, 3.0]), np.array([[1.0, 0.2], [0.2, 2.0]])
    given: dict[str, Any] = {"A": a, "B": b, "Q": q, "R": r}
    assert Lqr(**given).gain == pytest.approx(control.lqr(a, b, q, r)[0], rel=1e-9)
    assert Lqr(**given, model="discrete").gain == pytest.approx(control.dlqr(a, b, q, r)[0], rel=1e-9)
    sampled = control.sample_system(control.ss(a, b, np.eye(4), np.zeros((4, 2))), 0.05)
    wanted = control.dlqr(sampled.A, sampled.B, q, r)[0]
    assert Lqr(**given, model="sampled", period=0.05).gain == pytest.approx(wanted, rel=1e-9)


def test_it_feeds_the_difference_from_the_target_back() -> None:
    found = drive(Lqr(**DOUBLE), x=[[1.0, 2.0], [0.0, 0.0]], target=[[0.0, 0.0], [1.0, 0.0]])
    assert found.u == pytest.approx([-1.0 - 2.0 * np.sqrt(3.0), 1.0], rel=1e-9)
    two = Lqr(A=[[0.0]], B=[[1.0, 1.0]], Q=[[2.0]], R=[[1.0, 0.0], [0.0, 1.0]])
    assert drive(two, x=[1.0]).u == pytest.approx(np.array([[-1.0, -1.0]]), rel=1e-9)


def test_weights_that_rounding_makes_negative_are_taken() -> None:
    c = np.array([[0.1, 0.3]])
    assert Lqr(**DOUBLE | {"Q": c.T @ c - 1e-16 * np.eye(2)}).gain.shape == (1, 2)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"Q": [[1, 0], [0, -1]]}, "Q must have no negative eigenvalue, its smallest is -1"),
        ({"Q": [[1, 0.5], [0, 1]]}, "Q must be symmetric"),
        ({"R": [[0.0]]}, "R must be positive definite, its smallest eigenvalue is 0"),
        ({"R": [[-2.0]]}, "R must be positive definite"),
        ({"A": [[2.0, 0], [0, -1]], "B": [[0], [1]]}, "it does not reach that with the pole 2"),
        ({"Q": [[0, 0], [0, 0]]}, "Q must weigh every mode that is not stable"),
        ({"B": [[0], [1], [1]]}, "B must have 2 rows, one for each state, got 3"),
    ],
)
def test_a_design_that_cannot_be_is_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        Lqr(**DOUBLE | wrong)


@pytest.mark.parametrize("kind", ["txt", "npz", "yaml"])
def test_the_model_may_stand_in_a_file(kind: str, tmp_path: Path) -> None:
    path = str(tmp_path / f"cart.{kind}")
    if kind == "npz":
        np.savez(path, A=CART["A"], B=CART["B"], C=np.eye(4))
    else:
        rows = {name: "\n".join(" ".join(map(str, row)) for row in CART[name]) for name in "AB"}
        yaml = f"A: {CART['A']}\nB: {CART['B']}\n"
        Path(path).write_text(yaml if kind == "yaml" else f"A\n{rows['A']}\nB\n{rows['B']}\n")
    block = Lqr(file=path, Q=CART["Q"], R=CART["R"])
    assert block.gain == pytest.approx(np.array(K_CART), rel=1e-8)
    assert drive(block, x=[[1.0, 0.0, 0.0, 0.0]]).u == pytest.approx([3.1622776601683795])


def test_a_model_is_given_once_and_at_its_rate(tmp_path: Path) -> None:
    (tmp_path / "m.yaml").write_text("A: [[0.5]]\nB: [[1]]\ndt: 0.1\n")
    weights: dict[str, Any] = {"file": str(tmp_path / "m.yaml"), "Q": [[1.0]], "R": [[1.0]]}
    wanted = control.dlqr([[0.5]], [[1.0]], [[1.0]], [[1.0]])[0]
    assert Lqr(**weights, model="discrete", period=0.1).gain == pytest.approx(wanted)
    with pytest.raises(ParameterError, match="file must be left out where one of A, B is given"):
        Lqr(**weights, A=[[1.0]])
    with pytest.raises(ParameterError, match=r"model must be discrete, since the file has one every 0\.1 s"):
        Lqr(**weights)
    with pytest.raises(ParameterError, match=r"file must have a model that is sampled every 0\.2 s"):
        Lqr(**weights, model="discrete", period=0.2)
    with pytest.raises(ParameterError, match="A must be given, or a 'file' with A, B"):
        Lqr(Q=[[1.0]], R=[[1.0]])
