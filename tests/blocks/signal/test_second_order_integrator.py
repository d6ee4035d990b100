"""Tests of the block signal.second_order_integrator: impacts against the closed form of a bouncing ball."""

from __future__ import annotations

import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.testing import drive
from quadvis_blocks.signal.second_order_integrator import SecondOrderIntegrator

G = 9.81
BALL = """\
quadvis: 1
name: ball
solver: {method: METHOD, step: 10 ms}
stop_time: STOP
blocks:
  ball:
    block: signal.second_order_integrator
    with: {initial: 1 m, lower: 0 m, restitution: 0.7}
    in: {u: -9.81 m/s^2}
"""


def impacts(restitution: float, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return when a ball that falls from 1 m meets the floor, and with which speed it leaves it each time."""
    first = np.sqrt(2 / G)
    speeds = G * first * restitution ** np.arange(1, count + 1)
    return first + np.append(0.0, np.cumsum(2 * speeds / G))[:-1], speeds


def height(time: float, restitution: float = 0.7) -> float:
    begins, speeds = impacts(restitution, 200)
    if time < begins[0]:
        return 1 - G * time**2 / 2
    flight = np.searchsorted(begins, time, "right") - 1
    since = time - begins[flight]
    return max(0.0, float(speeds[flight] * since - G * since**2 / 2))


@pytest.mark.parametrize("method", ["ode2", "ode3", "ode4"])
def test_a_bouncing_ball_follows_the_closed_form(method: str) -> None:
    result = load_text(BALL.replace("METHOD", method).replace("STOP", "2.3 s")).run()
    truth = [height(time) for time in result.times("ball.x")]
    assert result["ball.x"] == pytest.approx(np.array(truth), abs=1e-9)


def test_it_never_falls_through_the_floor_and_comes_to_rest() -> None:
    result = load_text(BALL.replace("METHOD", "ode4").replace("STOP", "10 s")).run()
    x, v, times = result["ball.x"], result["ball.v"], result.times("ball.x")
    assert x.min() >= 0.0
    begins, _ = impacts(0.7, 200)
    assert begins[-1] == pytest.approx(np.sqrt(2 / G) * 1.7 / 0.3)  # after infinitely many
    assert not x[times >= 2.6].any() and not v[times >= 2.6].any()
    assert result["ball.x"] == pytest.approx([height(time) for time in times], abs=1e-5)


def test_the_heights_of_the_rebounds_fall_by_the_square_of_the_restitution() -> None:
    result = load_text(BALL.replace("METHOD", "ode4").replace("STOP", "2.3 s").replace("10 ms", "1 ms")).run()
    x = result["ball.x"]
    peaks = [each for before, each, after in zip(x, x[1:], x[2:], strict=False) if before <= each > after]
    assert peaks[:5] == pytest.approx(0.49 ** np.arange(1, 6), abs=5e-6)  # G (0.5 ms)^2 / 2 beside a row


@pytest.mark.slow
def test_both_engines_give_the_same_bits() -> None:
    diagram = load_text(BALL.replace("METHOD", "ode4").replace("STOP", "3 s"))
    native = diagram.run(engine="native")
    assert native["ball.x"].tobytes() == diagram.run(engine="python")["ball.x"].tobytes()
    assert str(native.engine) == "native"


def test_a_stop_without_restitution_holds_until_the_input_points_away() -> None:
    u = np.repeat([1.0, -1.0], [30, 30])
    found = drive(SecondOrderIntegrator(upper=2.0), u=u, rate="10 Hz")
    assert found.x[:20] == pytest.approx((np.arange(20) / 10) ** 2 / 2)
    assert found.x[21:31] == pytest.approx(np.full(10, 2.0), abs=1e-12)
    assert found.v[21:31] == pytest.approx(np.zeros(10), abs=1e-12)
    assert found.x[40] == pytest.approx(2.0 - 0.5, abs=1e-9)  # at once, not after a wind-up


def test_an_impact_without_loss_keeps_the_energy() -> None:
    found = drive(
        SecondOrderIntegrator(initial=0.5, lower=0.0, restitution=1.0), u=np.full(500, -1.0), rate="50 Hz"
    )
    assert found.v**2 / 2 + found.x == pytest.approx(np.full(500, 0.5), abs=1e-9)


def test_it_bounces_between_two_stops_element_by_element() -> None:
    block = SecondOrderIntegrator(
        initial=[0.0, 0.25], initial_rate=[1.0, -3.0], lower=-1.0, upper=[1.0, 0.5], restitution=1.0
    )
    found = drive(block, u=np.zeros((100, 2)), rate="10 Hz")
    times = np.arange(100) / 10

    def wave(time: np.ndarray, begin: float, speed: float, lower: float, upper: float) -> np.ndarray:
        span = upper - lower
        way = np.mod(begin - lower + speed * time, 2 * span)
        return lower + np.where(way > span, 2 * span - way, way)

    assert found.x[:, 0] == pytest.approx(wave(times, 0.0, 1.0, -1.0, 1.0), abs=1e-8)
    assert found.x[:, 1] == pytest.approx(wave(times, 0.25, -3.0, -1.0, 0.5), abs=1e-8)


def test_it_rests_at_a_stop_from_the_start() -> None:
    u = np.repeat([-1.0, 1.0], [10, 10])
    found = drive(SecondOrderIntegrator(lower=0.0), u=u, rate="10 Hz")
    assert not found.x[:11].any()
    assert found.x[19] == pytest.approx(0.9**2 / 2, abs=1e-12)


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"lower": 1.0, "upper": 0.0}, "lower must be below upper, 0, got 1"),
        ({"lower": 0.0, "initial": -1.0}, "initial must lie between 0 and inf, got -1"),
    ],
)
def test_stops_that_exclude_the_start_are_refused(wrong: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        SecondOrderIntegrator(**wrong)
