from __future__ import annotations

from typing import Any

import control
import numpy as np
import pytest
import scipy.signal

from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.systems.pid import Pid

E = [1, 1, 0.8, 0.5, 0.1, -0.2, -0.3, -0.2, 0, 0.1]
GAINS = {"kp": 2.0, "ki": 1.5, "kd": 0.4, "filter_time": 0.125, "c": 1.0}
FORWARD = [5.2, 2.79, 1.388, 0.3576, -0.79748, -1.148496, -0.6916992, 0.24066016, 1.086132032, 1.0612264064]
TRAPEZOIDAL = [
    4.360714285714286, 3.2045918367346937, 1.9226822157434402, 0.7557923781757601, -0.5125175522103885,
    -1.1114360938044523, -0.8881154687733367, -0.07097805804571572, 0.8231522608375504, 1.0202795403589502,
]  # fmt: skip


def run(block: Pid, reference: Any, measurement: Any = 0.0, **more: Any) -> Any:
    return drive(block, reference=reference, measurement=measurement, rate="10 Hz", **more)


def parallel(share: float) -> Any:
    """Return the PID of the test as a sampled transfer function."""
    z = control.tf("z")
    integral = 0.1 * (share * z + 1.0 - share) / (z - 1.0)
    system = control.minreal(2.0 + 1.5 * integral + 0.4 * 8.0 / (1.0 + 8.0 * integral), verbose=False)
    return np.asarray(system.num[0][0]), np.asarray(system.den[0][0])


@pytest.mark.parametrize(("method", "wanted"), [("forward", FORWARD), ("trapezoidal", TRAPEZOIDAL)])
def test_sampled_it_has_the_numbers_of_the_recurrence(method: str, wanted: list[float]) -> None:
    assert run(Pid(**GAINS, method=method), E).y == pytest.approx(wanted, abs=1e-12)


@pytest.mark.parametrize(("method", "share"), [("forward", 0.0), ("backward", 1.0), ("trapezoidal", 0.5)])
def test_sampled_it_is_its_transfer_function(method: str, share: float) -> None:
    u = np.random.default_rng(3).normal(size=80)
    wanted = scipy.signal.lfilter(*parallel(share), u)
    assert run(Pid(**GAINS, method=method), u).y == pytest.approx(wanted, rel=1e-10, abs=1e-10)


def test_back_calculation_has_the_numbers_of_the_recurrence() -> None:
    e = [3, 3, 3, 3, 2, 1, 0.2, -0.5, -1, -1, -0.5, 0]
    free = [
        15.6, 3.13, 1.792, 1.9348, -2.87664, -4.878272, -4.6674208, -4.548544, -3.879744704, -1.5329704832,
        1.26600478464, 2.580799838208,
    ]  # fmt: skip
    block = Pid(**GAINS, method="forward", lower=-2.0, upper=2.5, anti_windup="back_calculation", kb=4.0)
    result = run(block, e)
    assert result.free == pytest.approx(free, abs=1e-12)
    assert result.y == pytest.approx(np.clip(free, -2.0, 2.5), abs=1e-12)


def test_continuous_it_is_the_closed_form() -> None:
    found = drive(Pid(**GAINS, method="continuous"), reference=1.0, measurement=0.0, steps=2001, rate="1 ms")
    wanted = [
        5.2, 4.220024147314046, 3.587852685175109, 2.8080729063571606, 2.8086100444439492, 3.5010734804092882,
        5.000000360112559,
    ]  # fmt: skip
    assert found.y[[0, 50, 100, 250, 500, 1000, 2000]] == pytest.approx(wanted, abs=1e-9)


def test_a_step_of_the_reference_leaves_the_derivative_alone() -> None:
    step = np.repeat([0.0, 1.0], 5)
    plain, alone = Pid(kp=0.0, kd=3.0, filter_time=0.2), Pid(kp=0.0, kd=3.0, filter_time=0.2, c=1.0)
    assert not run(plain, step, 0.0).y.any()
    assert run(alone, step).y == pytest.approx(-run(plain, np.zeros(10), step).y)


def test_the_proportional_part_may_weigh_the_reference() -> None:
    assert run(Pid(kp=2.0, b=0.25), [4.0], [1.0]).y.tolist() == [0.0]


@pytest.mark.parametrize("anti_windup", ["clamping", "back_calculation", "none"])
@pytest.mark.parametrize("method", ["continuous", "forward", "backward", "trapezoidal"])
def test_negated_signals_negate_the_output(method: str, anti_windup: str) -> None:
    e = 3.0 * np.random.default_rng(5).normal(size=60)
    made = [
        Pid(**GAINS, method=method, anti_windup=anti_windup, lower=low, upper=high)
        for low, high in ((-1.0, 2.0), (-2.0, 1.0))
    ]
    assert np.array_equal(run(made[0], e).y, -run(made[1], -e).y)


@pytest.mark.parametrize("anti_windup", ["clamping", "back_calculation"])
def test_without_an_integral_gain_there_is_no_integral_part(anti_windup: str) -> None:
    found = run(Pid(kp=5.0, upper=1.0, lower=-1.0, anti_windup=anti_windup), 10.0 * np.ones(50))
    assert found.state("integral") == 0.0


def test_clamping_leaves_the_limit_at_once() -> None:
    e = np.array([10.0] * 100 + [-1.0] * 3)
    found = run(Pid(kp=0.0, ki=1.0, method="forward", upper=1.0), e).y
    assert found[100] == 1.0
    assert found[101:] == pytest.approx([0.9, 0.8])


@pytest.mark.parametrize("method", ["continuous", "forward", "backward", "trapezoidal"])
def test_after_manual_mode_the_output_goes_on_from_the_command(method: str) -> None:
    rng = np.random.default_rng(7)
    reference, measurement = rng.normal(size=40), rng.normal(size=40)
    manual = np.arange(40) < 20
    command = np.linspace(0.0, 1.5, 40)
    block = Pid(**GAINS, method=method)
    found = run(block, reference, measurement, manual=manual, command=command)
    assert found.y[:20].tolist() == command[:20].tolist()
    assert found.y[20] == pytest.approx(command[19], abs=1e-12)
    # The time in manual mode has added nothing: one that was in it only for the last tick goes on alike.
    short = run(Pid(**GAINS | {"kd": 0.0}, method=method), reference[19:], measurement[19:],
                manual=manual[19:], command=command[19:])  # fmt: skip
    long = run(
        Pid(**GAINS | {"kd": 0.0}, method=method), reference, measurement, manual=manual, command=command
    )
    assert long.y[20:] == pytest.approx(short.y[1:], abs=1e-12)


def test_a_command_beyond_the_limits_is_held_at_them() -> None:
    block = Pid(kp=1.0, ki=1.0, upper=2.0)
    found = run(block, 0.5, 0.0, manual=[True, True, False], command=9.0)
    assert found.y.tolist() == [2.0, 2.0, 2.0]
    assert found.free[2] == 2.0


@pytest.mark.parametrize("method", ["continuous", "forward", "backward", "trapezoidal"])
def test_it_may_begin_with_an_output(method: str) -> None:
    """A plant that stands at its set-point, with the output that this takes, stays there."""
    block = Pid(**GAINS, method=method, initial=0.7, begin="output")
    assert run(block, 4.0 * np.ones(20), 4.0).y == pytest.approx(np.full(20, 0.7), abs=1e-12)


def test_elements_have_gains_and_limits_of_their_own() -> None:
    e = np.random.default_rng(9).normal(size=(30, 2))
    kp, ki, upper = [1.0, 2.0], [0.5, 0.0], [0.3, 9.0]
    both = run(Pid(kp=kp, ki=ki, upper=upper), e, np.zeros(2))
    for index in range(2):
        alone = run(Pid(kp=kp[index], ki=ki[index], upper=upper[index]), e[:, index])
        assert np.array_equal(both.y[:, index], alone.y)


@pytest.mark.parametrize(
    ("wrong", "problem"),
    [
        ({"kd": 1.0, "method": "continuous"}, "filter_time must be above 0 s where kd is not 0, got 0 s"),
        ({"kd": 1.0, "method": "trapezoidal"}, "filter_time must be above 0 s"),
        (
            {"kd": 1.0, "method": "forward", "filter_time": 0.01, "period": 0.1},
            "at least 0.05 s, half the period",
        ),
        ({"lower": 2.0, "upper": 1.0}, "lower must be at most upper, 1, got 2"),
    ],
)
def test_what_cannot_run_is_refused(wrong: dict[str, Any], problem: str) -> None:
    with pytest.raises(ParameterError, match=problem):
        Pid(**wrong)
