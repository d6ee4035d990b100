import math

import control
import numpy as np
import pytest
from pytest import approx

import quadvis
from quadvis.analysis.margins import Margins
from quadvis.api import load_text
from tests.stages import mostly_slow

from .loops import DIAGRAMS, lifted, limitless, sampled, write


@pytest.fixture(scope="module")
def chain():
    return quadvis.load(DIAGRAMS / "margins.yaml").analyse()


@pytest.mark.parametrize(
    ("cut", "crossover", "phase", "delay", "down", "up"),
    [
        ("torque", 4.03, 68.6, 0.297, 0.2, math.inf),
        ("vision", 0.69, 43.5, 1.10, 0.0, 5.0),
        ("imu", 4.23, 67.0, 0.28, 0.447, math.inf),
    ],
)
def test_the_papers_loop_has_the_known_margins(chain, cut, crossover, phase, delay, down, up) -> None:
    margins = chain.loops[cut].margins
    assert margins.crossover == approx(crossover, abs=0.006)
    assert math.degrees(margins.phase_lag) == approx(phase, abs=0.5)
    assert margins.delay == approx(delay, abs=0.005)
    assert (margins.gain_down, margins.gain_up) == (approx(down, abs=5e-4), approx(up, abs=5e-4))


def test_the_loop_at_the_torque_is_the_transfer_function_of_the_law_and_the_chain(chain) -> None:
    """Four integrators under the gains 1, 4, 6, 4: L = (4 s^3 + 6 s^2 + 4 s + 1) / s^4."""
    response = chain.loops["torque"].system(1j * np.array([0.3, 1.0, 4.0, 20.0]))
    s = 1j * np.array([0.3, 1.0, 4.0, 20.0])
    assert response == approx((4 * s**3 + 6 * s**2 + 4 * s + 1) / s**4, rel=1e-4)


def test_the_gains_at_which_it_becomes_unstable_are_those_of_routh(chain) -> None:
    """s^4 + k (4 s^3 + 6 s^2 + 4 s + 1) has roots on the axis at k = 1/5; with all of x at once, 5 and up."""
    assert chain.loops["torque"].margins.gain_down == approx(1 / 5, abs=1e-6)
    assert chain.loops["vision"].margins.gain_up == approx(5.0, abs=1e-5)
    assert chain.loops["imu"].margins.gain_down == approx(1 / math.sqrt(5), abs=1e-6)


def crosses(margins: Margins, system: control.StateSpace) -> None:
    """Compare with the gain 1 crossings that python-control finds of a loop with one signal."""
    _, phases, _, _, at_phases, _ = control.stability_margins(system, returnall=True)
    angles = np.radians(phases) % (2 * math.pi)
    assert margins.phase_lag == approx(angles.min(), abs=1e-4)
    assert margins.phase_lead == approx((2 * math.pi - angles).min(), abs=1e-4)
    assert margins.crossover == approx(at_phases[angles.argmin()], rel=1e-4)
    assert margins.delay == approx((angles / at_phases).min(), rel=1e-4)


def test_python_control_finds_the_same_margins_in_the_continuous_loop(chain) -> None:
    loop = chain.loops["torque"]
    crosses(loop.margins, loop.system)
    assert control.stability_margins(loop.system)[0] == approx(loop.margins.gain_down, rel=1e-4)


@pytest.mark.filterwarnings("ignore:invalid value encountered:RuntimeWarning")  # in python-control
@pytest.mark.parametrize(
    ("gain", "damping"), [("2 1/s^2", "1.5 1/s"), ("20 1/s^2", "6 1/s"), ("0.1 1/s^2", "9 1/s")]
)
def test_a_sampled_loop_has_the_margins_of_its_exact_discretisation(
    tmp_path, gain: str, damping: str
) -> None:
    plant = control.c2d(control.ss([[0, 1], [0, 0]], [[0], [1]], np.eye(2), np.zeros((2, 1))), 0.05)
    law = np.array([[float(gain.split()[0]), float(damping.split()[0])]])
    margins = sampled(tmp_path, gain=gain, damping=damping).analyse().loops["push"].margins
    crosses(margins, control.ss(plant.A, plant.B, law @ plant.C, 0, 0.05))
    assert margins.gain_up == approx(2 / 0.05 / law[0, 1], rel=1e-6)  # where a pole comes to -1
    assert margins.gain_down == 0.0


@pytest.mark.parametrize(("gain", "damping"), [("2 1/s^2", "1.5 1/s"), ("20 1/s^2", "6 1/s")])
def test_lifting_a_loop_of_one_rate_leaves_its_margins_and_its_bode_plot(
    tmp_path, gain: str, damping: str
) -> None:
    once, twice = (
        make(tmp_path, gain=gain, damping=damping).analyse().loops["push"] for make in (sampled, lifted)
    )
    assert len(twice.closed.channels) == 2 * len(once.closed.channels)
    assert vars(twice.margins) == approx(vars(once.margins), rel=1e-5)
    omega, values = twice.bode()
    assert omega[-1] > 1.9 * math.pi / 0.1  # beyond the lifted band, up to that of the cut itself
    expected = np.array([once.system(np.exp(1j * w * 0.05)) for w in omega])
    assert values == approx(expected, rel=1e-5)


def test_a_static_loss_of_stability_is_a_gain_margin_too(tmp_path) -> None:
    """x' = -x + y / 2 with y = x fed back: twice the gain makes the pole zero."""
    diagram = quadvis.load(
        write(
            tmp_path,
            """
quadvis: 1
name: fed
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  place: {block: signal.integrator, rate: continuous, with: {initial: 0 m}, in: {u: change.y}}
  decay: {block: signal.gain, rate: continuous, with: {factor: -1 1/s}, in: {u: place.y}}
  feed: {block: signal.gain, rate: continuous, with: {factor: 0.5 1/s}, in: {u: place.y}}
  change: {block: signal.sum, rate: continuous, in: {u: [decay.y, feed.y]}}
""",
        )
    )
    margins = diagram.analyse(cuts={"feed": "feed.y"}).loops["feed"].margins
    assert margins.gain_up == approx(2.0, rel=1e-6)
    assert (margins.gain_down, margins.phase_lag, margins.delay) == (0.0, math.inf, math.inf)
    assert math.isnan(margins.crossover)


def test_a_loop_that_is_not_stable_has_no_margins() -> None:
    analysis = quadvis.load(DIAGRAMS / "margins.yaml", settings={"lag": "0.6 s"}).analyse()
    assert not analysis.stable
    assert all(math.isnan(value) for value in vars(analysis.loops["torque"].margins).values())


@pytest.mark.parametrize(
    ("margin", "inside", "outside"),
    mostly_slow([("gain_up", 0.98, 1.02), ("gain_down", 1.02, 0.98)], quick=0),
)
def test_scaled_by_its_gain_margin_a_loop_of_several_rates_is_at_the_edge(margin, inside, outside) -> None:
    text = limitless("sampled_margins.yaml")
    found = getattr(load_text(text, DIAGRAMS).analyse().loops["torque"].margins, margin)

    def is_stable(factor: float) -> bool:
        scaled = f"""  more:
    {{block: signal.gain, rate: control, with: {{factor: {factor}}}, in: {{u: law.torque}}}}
"""
        changed = text.replace("  command:", f"{scaled}  command:").replace("[law.torque,", "[more.y,")
        return load_text(changed, DIAGRAMS).analyse().stable

    assert is_stable(found * inside) and not is_stable(found * outside)


@pytest.mark.slow
def test_a_cut_before_the_camera_and_one_behind_it_have_the_same_margins() -> None:
    """The position is sampled by the frames only, whatever it does at the fifty steps between them."""
    cuts = {"craft": "craft.position", "frame": "frame.y[0]"}
    loops = quadvis.load(DIAGRAMS / "sampled_margins.yaml").analyse(cuts=cuts).loops
    assert len(loops["craft"].closed.channels) == 50 * len(loops["frame"].closed.channels)
    assert vars(loops["craft"].margins) == approx(vars(loops["frame"].margins), rel=1e-4)


def test_two_cuts_may_share_a_signal(tmp_path) -> None:
    loops = lifted(tmp_path).analyse(cuts={"again": "push.y", "both": ["spring.y", "damper.y"]}).loops
    assert vars(loops["again"].margins) == approx(vars(loops["push"].margins), rel=1e-9)
    assert vars(loops["both"].margins) == approx(vars(loops["push"].margins), rel=1e-6)
