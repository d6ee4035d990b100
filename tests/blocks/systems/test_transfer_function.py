from __future__ import annotations

from pathlib import Path
from typing import Any

import control
import numpy as np
import pytest
import scipy.io
import scipy.signal

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.errors import QuadvisError
from quadvis.testing import drive
from quadvis_blocks.systems.transfer_function import TransferFunction

CONTROLS = {
    "forward": "forward_diff",
    "backward": "backward_diff",
}  # python-control's names, where they differ
U = np.random.default_rng(1).normal(size=60)
SYSTEMS = [
    ([3.0], [1.0, 1.2, 4.0]),
    ([1.0, 3.0, 900.0], [1.0, 30.0, 900.0]),
    ([0.5, 2.0], [1.0, 3.0]),
    ([2.0, 1.0, 1.0], [1.0, 2.0, 3.0, 1.0, 0.5]),
]
STEP = [0.0, 0.1, 0.5, 1.0, 2.0, 3.0, 5.0]


@pytest.mark.parametrize(("numerator", "denominator"), SYSTEMS)
@pytest.mark.filterwarnings("ignore:Badly conditioned")  # python-control makes polynomials of it
@pytest.mark.parametrize("method", ["zoh", "tustin", "matched", "foh", "impulse", "forward", "backward"])
def test_a_sampled_system_is_python_control_s(method: str, numerator: Any, denominator: Any) -> None:
    if method == "impulse" and len(numerator) == len(denominator):
        pytest.skip("scipy samples no impulse of a system with direct feedthrough")
    period = 0.02
    system = control.sample_system(
        control.tf(numerator, denominator), period, method=CONTROLS.get(method, method)
    )
    wanted = control.forced_response(system, period * np.arange(60), U).outputs
    block = TransferFunction(numerator=numerator, denominator=denominator, method=method)
    assert drive(block, u=U, rate="50 Hz").y == pytest.approx(wanted, rel=1e-10, abs=1e-10)


def test_tustin_may_keep_the_response_at_one_frequency() -> None:
    wanted = scipy.signal.lfilter(
        [0.8018522147522523, -1.2872525094183773, 0.7578193735860862],
        [1.0, -1.2872525094183773, 0.5596715883383385],
        U,
    )
    notch = {"numerator": [1.0, 3.0, 900.0], "denominator": [1.0, 30.0, 900.0], "method": "tustin"}
    found = drive(TransferFunction(**notch, prewarp=30.0), u=U, rate="50 Hz").y
    assert found == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    with pytest.raises(ParameterError, match=r"prewarp must be below half the sample rate, 157\.08 rad/s"):
        TransferFunction(**notch, prewarp=160.0, period=0.02)
    with pytest.raises(ParameterError, match="prewarp must be 0 unless method is tustin"):
        TransferFunction(**notch | {"method": "zoh"}, prewarp=30.0)


def test_zero_order_hold_has_the_numbers_of_the_matrix_exponential() -> None:
    b, a = [0.0, 0.014369969402995493, 0.013805836567701013], [1.0, -1.8493526954228956, 0.8869204367171575]
    block = TransferFunction(numerator=[3.0], denominator=[1.0, 1.2, 4.0], method="zoh")
    assert drive(block, u=U, rate="10 Hz").y == pytest.approx(scipy.signal.lfilter(b, a, U), rel=1e-9)


def test_integrators_are_sampled() -> None:
    block = TransferFunction(numerator=[1.0], denominator=[1.0, 0.0, 0.0], method="zoh")
    wanted = scipy.signal.lfilter([0.0, 0.005, 0.005], [1.0, -2.0, 1.0], U)
    assert drive(block, u=U, rate="10 Hz").y == pytest.approx(wanted, rel=1e-10, abs=1e-12)


def test_a_discrete_system_is_scipy_s_filter() -> None:
    u = [1, 0.5, -0.25, 2, 0, 0, -1, 3, 1, 1]
    y = [0.25, 0.325, 0.1975, 0.618, 0.4264, 0.29032, -0.123344, 0.5510208, 0.62536384, 0.763905792]
    block = TransferFunction(numerator=[0.25, -0.1, 0.05], denominator=[1, -1.2, 0.52], method="discrete")
    assert drive(block, u=u).y == pytest.approx(y, rel=1e-12)


def test_a_continuous_step_is_the_closed_form() -> None:
    wanted = [
        0.0, 0.05747987761198197, 1.1442496148637853, 3.0558921904821092,
        3.8832925296545007, 2.6625107963150496, 3.15375310934046,
    ]  # fmt: skip
    y = drive(
        TransferFunction(numerator=[12.0], denominator=[1.0, 1.2, 4.0]), u=1.0, steps=1001, rate="5 ms"
    ).y
    assert y[[round(t / 0.005) for t in STEP]] == pytest.approx(wanted, abs=1e-8)


def test_each_element_of_an_array_has_its_own_states() -> None:
    def made(**more: Any) -> TransferFunction:
        return TransferFunction(numerator=[1.0, 3.0], denominator=[1.0, 1.2, 4.0], gain=2.0, **more)

    for method in ("continuous", "zoh", "tustin"):
        one = drive(made(method=method), u=U, rate="50 Hz").y
        both = drive(
            made(method=method, initial_input=[0.0, 1.0]), u=np.stack([U, np.ones(60)], 1), rate="50 Hz"
        )
        assert both.y[:, 0] == pytest.approx(one, rel=1e-12, abs=1e-14)
        assert both.y[:, 1] == pytest.approx(np.full(60, 2.0 * 3.0 / 4.0), rel=1e-9)


@pytest.mark.parametrize("method", ["continuous", "zoh", "tustin", "foh", "backward", "matched"])
def test_from_the_steady_state_of_an_input_the_output_stands_still(method: str) -> None:
    block = TransferFunction(
        numerator=[2.0, 3.0], denominator=[1.0, 2.0, 4.0], method=method, initial_input=5.0
    )
    assert drive(block, u=5.0, steps=50, rate="10 Hz").y == pytest.approx(np.full(50, 3.75), rel=1e-9)


def test_an_integrator_has_no_steady_state() -> None:
    with pytest.raises(ParameterError, match="initial_input must be 0, since with a pole at 0"):
        TransferFunction(numerator=[1.0], denominator=[1.0, 0.0], initial_input=1.0)


def test_equal_degrees_make_direct_feedthrough_and_lower_ones_break_loops() -> None:
    direct = TransferFunction(numerator=[2.0, 1.0], denominator=[4.0, 1.0])
    assert direct.interface.feedthrough == {"u"}
    assert drive(direct, u=3.0, steps=1).y[0] == 1.5
    assert not TransferFunction(numerator=[1.0], denominator=[4.0, 1.0]).interface.feedthrough
    assert not TransferFunction(numerator=[1.0], denominator=[4.0, 1.0], method="zoh").interface.feedthrough
    tustin = TransferFunction(numerator=[1.0], denominator=[4.0, 1.0], method="tustin")
    assert tustin.interface.feedthrough == {"u"}


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"numerator": [1.0, 0.0], "denominator": [2.0]}, r"add a filter, N/\(s \+ N\)"),
        ({"denominator": [0.0, 0.0]}, "denominator must be finite, and not 0"),
        (
            {"numerator": [1.0, 0.0], "denominator": [1.0, 2.0], "method": "matched", "period": 0.1},
            "finite gain",
        ),
        ({"numerator": [1e300, 1.0], "denominator": [1e-300, 2.0]}, "gain must be such that"),
    ],
)
def test_what_is_no_system_is_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        TransferFunction(**wrong)


def test_a_system_of_python_control_becomes_a_block() -> None:
    system = control.tf([1.0, 2.0], [1.0, 3.0, 5.0])
    block = TransferFunction.of(system, method="zoh", gain=2.0)
    wanted = control.forced_response(control.sample_system(system, 0.1), 0.1 * np.arange(60), 2.0 * U).outputs
    assert drive(block, u=U, rate="10 Hz").y == pytest.approx(wanted, rel=1e-10, abs=1e-12)
    sampled = TransferFunction.of(control.sample_system(system, 0.1))
    assert sampled.period == 0.1
    assert drive(sampled, u=2.0 * U, rate="10 Hz").y == pytest.approx(wanted, rel=1e-9, abs=1e-12)
    from_states = TransferFunction.of(control.ss([[-1.0]], [[2.0]], [[3.0]], [[0.0]]))
    assert from_states.numerator.tolist()[-1] == pytest.approx(6.0)
    with pytest.raises(
        QuadvisError, match=r"one input and one output here, not 1 and 2; use systems\.state_space"
    ):
        TransferFunction.of(control.ss([[-1.0]], [[2.0]], [[3.0], [1.0]], [[0.0], [0.0]]))


def _written(folder: Path, kind: str) -> str:
    path = folder / f"motor.{kind}"
    num, den = [3.0], [1.0, 1.2, 4.0]
    if kind == "npz":
        np.savez(path, num=num, den=den)
    elif kind == "mat":
        scipy.io.savemat(path, {"num": num, "den": den})
    elif kind == "yaml":
        path.write_text("numerator: 3\ndenominator: [1, 1.2, 4]\n")
    else:
        path.write_text("numerator\n3\n\ndenominator  # in s\n1, 1.2, 4\n")
    return path.name


@pytest.mark.parametrize("kind", ["npz", "mat", "yaml", "csv"])
def test_the_polynomials_may_stand_in_a_file(kind: str, tmp_path: Path) -> None:
    text = f"""quadvis: 1
name: step
solver: {{method: ode4, step: 10 ms}}
stop_time: 1 s
blocks:
  plant:
    block: systems.transfer_function
    with: {{file: {_written(tmp_path, kind)}, gain: 4 rad/s/V}}
    in: {{u: 1 V}}
"""
    diagram = load_text(text, tmp_path)
    assert diagram.run()["plant.y"][-1] == pytest.approx(3.0558921904821092, abs=1e-7)


@pytest.mark.parametrize(
    ("name", "data", "problem"),
    [
        ("g.csv", b"num\n1 2\n", "there is no 'denominator'; it has num"),
        ("g.csv", b"num\n1 x\n", "line 2 is no row of numbers"),
        ("g.csv", b"num\n1 2\n3\n", "line 3 has 1 numbers, the row above has 2"),
        ("g.yaml", b"num: {a: 1}\n", "there is no 'numerator'; it has nothing"),
        ("g.yaml", b"num: [1, 2", "it has no lists of numbers under names"),
        ("g.yaml", b"num: [1e999]\nden: 1", "it has no lists of numbers under names"),
        ("g.npz", b"PK", "it is no .npz file that can be read"),
        ("g.mat", b"nothing", "it is no .mat file that can be read"),
    ],
)
def test_a_file_that_is_no_system_is_refused(name: str, data: bytes, problem: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(data)
    with pytest.raises(QuadvisError, match=problem):
        TransferFunction(file=str(tmp_path / name))


def test_files_and_polynomials_exclude_each_other(tmp_path: Path) -> None:
    (tmp_path / "g.csv").write_text("num\n1\nden\n1 2\n")
    with pytest.raises(ParameterError, match="file must be left out where numerator or denominator is given"):
        TransferFunction(file=str(tmp_path / "g.csv"), numerator=[2.0])
