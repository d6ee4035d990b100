from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.kalman import Kalman
from tests.stages import mostly_slow

A, C = np.array([[1.0, 0.1], [0.0, 1.0]]), np.array([[1.0, 0.0]])
Q, R = np.array([[1.25e-05, 0.00025], [0.00025, 0.005]]), np.array([[0.04]])
MOTION: dict[str, Any] = {"A": A, "C": C, "Q": Q, "R": R}
GAIN = np.array([[0.23334571710171653], [0.3095670934745575]])
AFTER = [0.00933382868406866, 0.03518903769497299]


def textbook(model: dict[str, Any], y: Any, u: Any, valid: Any, x: Any, p: Any) -> tuple[Any, Any]:
    """Return estimates and variances by the equations of a textbook, with inverses."""
    a, b, c, q, r = (np.asarray(model[name]) for name in ("A", "B", "C", "Q", "R"))
    estimates, variances = [], []
    for k in range(len(y)):
        if valid[k]:
            gain = p @ c.T @ np.linalg.inv(c @ p @ c.T + r)
            x, p = x + gain @ (y[k] - c @ x), (np.eye(len(a)) - gain @ c) @ p
        estimates.append(x)
        variances.append(np.diag(p))
        x, p = a @ x + b @ u[k], a @ p @ a.T + q
    return np.array(estimates), np.array(variances)


def test_the_steady_gain_is_that_of_the_riccati_iteration() -> None:
    block = Kalman(**MOTION, gain="steady")
    assert block.settled @ block.whitening == pytest.approx(GAIN, rel=1e-7)
    assert np.diag(block.after) == pytest.approx(AFTER, rel=1e-7)
    predictor = control.dlqe(A, np.eye(2), C, Q, R)[0]
    assert A @ block.settled @ block.whitening == pytest.approx(predictor, rel=1e-7)


def test_the_varying_gain_comes_to_the_steady_one() -> None:
    y = np.random.default_rng(1).normal(size=400)
    varying, steady = (
        drive(Kalman(**MOTION, gain=gain, spread=[1.0]), y=y) for gain in ("varying", "steady")
    )
    assert varying.variances[-1] == pytest.approx(AFTER, rel=1e-7)
    assert steady.variances[0] == pytest.approx(AFTER, rel=1e-7)
    assert varying.x[-1] == pytest.approx(steady.x[-1], abs=1e-7)


def test_it_is_the_textbook_s_with_correlated_noise_and_missing_measurements() -> None:
    rng = np.random.default_rng(2)
    model = {
        "A": rng.normal(size=(3, 3)) * 0.4, "B": rng.normal(size=(3, 2)), "C": rng.normal(size=(2, 3)),
        "Q": np.diag([0.1, 0.0, 0.3]), "R": np.array([[0.5, 0.2], [0.2, 0.3]]),
    }  # fmt: skip
    y, u, valid = rng.normal(size=(50, 2)), rng.normal(size=(50, 2)), rng.random(50) < 0.7
    initial, spread = [1.0, -1.0, 2.0], [2.0, 3.0, 1.0]
    found = drive(Kalman(**model, initial=initial, spread=spread), y=y, u=u, valid=valid)
    estimates, variances = textbook(model, y, u, valid, np.array(initial), np.diag(spread))
    assert found.x == pytest.approx(estimates, rel=1e-9, abs=1e-10)
    assert found.variances == pytest.approx(variances, rel=1e-9)


def test_without_measurements_it_only_predicts() -> None:
    found = drive(Kalman(**MOTION, initial=[0.0, 1.0]), y=np.full(20, 9.0), valid=False)
    assert found.x == pytest.approx(np.stack([0.1 * np.arange(20), np.ones(20)], 1))


def test_precise_measurements_leave_the_covariance_whole() -> None:
    """Joseph's form: (I - KC) P loses its symmetry and becomes negative here."""
    block = Kalman(A=A, C=C, Q=1e-9 * np.eye(2), R=[[1e-12]], spread=[1e6])
    found = drive(block, y=np.sin(0.01 * np.arange(3000)))
    covariance = found.state("covariance")
    assert np.array_equal(covariance, covariance.T)
    assert np.linalg.eigvalsh(covariance).min() >= 0.0
    assert (found.variances >= 0.0).all()


@pytest.mark.parametrize("seconds", mostly_slow([100, 1000], quick=0, slow=1))
def test_ever_so_many_precise_measurements_leave_no_negative_variance(seconds: int, tmp_path: Path) -> None:
    text = """quadvis: 1
name: precise
rates: {fast: 1 kHz}
stop_time: 1000 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: 2, frequency: 3 Hz}}
  filter:
    block: systems.kalman
    rate: fast
    with:
      {A: [[1, 0.1], [0, 1]], C: [[1, 0]], Q: [[1.0e-9, 0], [0, 1.0e-9]], R: [[1.0e-12]], spread: [1.0e6]}
    in: {y: wave.y}
"""
    result = load_text(text.replace("1000 s", f"{seconds} s"), tmp_path).run(
        engine="native", keep=["filter.*"]
    )
    variances = result["filter.variances"]
    assert len(variances) == 1000 * seconds + 1
    assert (variances > 0.0).all()
    assert np.isfinite(result["filter.x"][-1]).all()


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"Q": -Q}, "Q must have no negative eigenvalue"),
        ({"R": [[0.0]]}, "R must be positive definite"),
        ({"B": [[1.0]]}, "B must be 2 x 1 finite numbers, got 1 x 1"),
        ({"C": [[1.0]]}, "C must be 1 x 2 finite numbers, got 1 x 1"),
        ({"C": [[0.0, 1.0]], "gain": "steady"}, "it does not show that with the pole 1"),
        ({"initial": [1.0, 2.0, 3.0]}, "initial must be 2 finite values, or one for all"),
    ],
)
def test_a_model_that_cannot_be_is_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        Kalman(**MOTION | wrong)


def test_the_model_may_stand_in_a_file(tmp_path: Path) -> None:
    a, b, c = [[1.0, 0.1], [0.0, 1.0]], [[0.0], [0.1]], [[1.0, 0.0]]
    weights: dict[str, Any] = {"Q": [[1e-4, 0.0], [0.0, 1e-2]], "R": [[0.04]]}
    (tmp_path / "m.yaml").write_text(f"A: {a}\nB: {b}\nC: {c}\ndt: 0.1\n")
    held, given = (
        Kalman(file=str(tmp_path / "m.yaml"), **weights, period=0.1),
        Kalman(A=a, B=b, C=c, **weights),
    )
    signals: dict[str, Any] = {"y": [0.0, 1.0, 3.0], "u": [1.0, 0.0, 2.0], "rate": "10 Hz"}
    assert np.array_equal(drive(held, **signals).x, drive(given, **signals).x)
    with pytest.raises(ParameterError, match="A must be given, or a 'file' with A, B, C"):
        Kalman(**weights)
    with pytest.raises(ParameterError, match=r"file must have a model that is sampled every 0\.2 s"):
        Kalman(file=str(tmp_path / "m.yaml"), **weights, period=0.2)
