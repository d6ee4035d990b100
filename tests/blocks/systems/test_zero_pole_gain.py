from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.io
import scipy.signal

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.zero_pole_gain import ZeroPoleGain

U = np.random.default_rng(1).normal(size=60)
SYSTEMS = [
    ("", "-2, -1+3j, -1-3j", 6.0),
    ("-1", "-2 -3 -4", 2.0),
    ("-1+1j -1-1j -5", "-2+1j -2-1j -3", 0.5),
    ("-4, -6", "-1+2i, -1-2i, -3, -5", 1.5),
]


def polynomials(zeros: str, poles: str, gain: float) -> tuple[Any, Any]:
    """Return the system as polynomials."""
    roots = [
        [complex(word.replace("i", "j")) for word in text.replace(",", " ").split()]
        for text in (zeros, poles)
    ]
    return gain * np.atleast_1d(np.poly(roots[0])).real, np.poly(roots[1]).real


@pytest.mark.filterwarnings("ignore:Badly conditioned")  # python-control makes polynomials of it
@pytest.mark.parametrize(("zeros", "poles", "gain"), SYSTEMS)
@pytest.mark.parametrize("method", ["zoh", "tustin", "matched"])
def test_a_sampled_system_is_python_control_s(method: str, zeros: str, poles: str, gain: float) -> None:
    system = control.sample_system(control.tf(*polynomials(zeros, poles, gain)), 0.05, method=method)
    wanted = control.forced_response(system, 0.05 * np.arange(60), U).outputs
    found = drive(ZeroPoleGain(zeros=zeros, poles=poles, gain=gain, method=method), u=U, rate="20 Hz").y
    assert found == pytest.approx(wanted, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize(("zeros", "poles", "gain"), SYSTEMS)
def test_a_continuous_step_is_scipy_s(zeros: str, poles: str, gain: float) -> None:
    time = 0.002 * np.arange(501)
    _, wanted = scipy.signal.step(polynomials(zeros, poles, gain), T=time)
    found = drive(ZeroPoleGain(zeros=zeros, poles=poles, gain=gain), u=1.0, steps=501, rate="2 ms").y
    assert found == pytest.approx(wanted, rel=1e-8, abs=1e-9)


def test_a_discrete_system_is_scipy_s_filter() -> None:
    b, a = polynomials("0.5+0.2j 0.5-0.2j -0.9", "0.3+0.6j 0.3-0.6j 0.8", 2.0)
    block = ZeroPoleGain(
        zeros="0.5+0.2j 0.5-0.2j -0.9", poles="0.3+0.6j 0.3-0.6j 0.8", gain=2.0, method="discrete"
    )
    assert drive(block, u=U).y == pytest.approx(scipy.signal.lfilter(b, a, U), rel=1e-10, abs=1e-10)


def test_a_system_of_python_control_becomes_a_block() -> None:
    system = control.zpk([-4.0], [-1 + 2j, -1 - 2j, -3.0], 5.0)
    wanted = control.forced_response(control.sample_system(system, 0.1), 0.1 * np.arange(60), U).outputs
    block = ZeroPoleGain.of(system, method="zoh")
    assert block.gain == pytest.approx(5.0, rel=1e-9)
    assert drive(block, u=U, rate="10 Hz").y == pytest.approx(wanted, rel=1e-9, abs=1e-10)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"poles": "-1+2j"}, "poles must have the conjugate of each complex number"),
        (
            {"poles": "-1 two"},
            "poles must be numbers such as -2 or -1\\+3j, without blanks inside, got 'two'",
        ),
        ({"zeros": "-1 -2", "poles": "-3"}, "no more than poles, 1, got 2; add a pole, -N, as a filter"),
        (
            {"zeros": "0", "poles": "-3 -4", "method": "matched", "period": 0.1},
            "which needs a finite gain at 0",
        ),
    ],
)
def test_what_is_no_system_is_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        ZeroPoleGain(**wrong)


@pytest.mark.parametrize("kind", ["txt", "npz", "mat", "yaml"])
def test_the_roots_may_stand_in_a_file(kind: str, tmp_path: Path) -> None:
    path, poles = tmp_path / f"g.{kind}", [-2.0, -1 + 3j, -1 - 3j]
    if kind == "npz":
        np.savez(path, z=np.array([-1.0]), p=np.array(poles), k=5.0)
    elif kind == "mat":
        scipy.io.savemat(path, {"z": [[-1.0]], "p": np.array(poles)[:, None], "k": 5.0})
    else:
        path.write_text("zeros\n-1\npoles\n-2 -1+3j -1-3j\ngain\n5\n" if kind == "txt" else
            "zeros: [-1]\npoles: [-2, -1+3j, -1-3j]\ngain: 5\n")  # fmt: skip
    held = drive(ZeroPoleGain(file=str(path)), u=1.0, rate="100 Hz", steps=101)
    given = drive(ZeroPoleGain(zeros="-1", poles="-2 -1+3j -1-3j", gain=5.0), u=1.0, rate="100 Hz", steps=101)
    assert held.y == pytest.approx(given.y, rel=1e-12)
    with pytest.raises(ParameterError, match="file must be left out where zeros or poles are given"):
        ZeroPoleGain(file=str(path), poles="-1")


def test_a_file_with_half_a_pair_is_refused(tmp_path: Path) -> None:
    (tmp_path / "g.txt").write_text("poles\n-1+3j -2\ngain\n1\n")
    with pytest.raises(
        ParameterError, match="file must have the conjugate of each complex number of its poles"
    ):
        ZeroPoleGain(file=str(tmp_path / "g.txt"))
