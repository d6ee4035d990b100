import math

import pytest
from pytest import approx

import quadvis
from quadvis.api import Diagram
from quadvis.errors import DiagramError
from tests.stages import mostly_slow

from .loops import DIAGRAMS, sampled, write


def limit(diagram: Diagram, name: str, start: str, end: str):
    """The answer to one question."""
    return diagram.analyse(limits={"asked": (name, start, end)}).limits["asked"]


def bare(name: str, variant: str | None = None, **settings: str) -> Diagram:
    return quadvis.load(DIAGRAMS / name, variant=variant, settings=settings)


@pytest.mark.parametrize("bandwidth", mostly_slow([2.0, 1.0]))
def test_the_motor_lag_that_the_law_tolerates_goes_as_1_over_its_bandwidth(bandwidth: float) -> None:
    """s^5 lag + s^4 + 4 s^3 + 6 s^2 + 4 s + 1: Routh's array changes sign at lag = 0.5685 / bandwidth."""
    analysis = bare("margins.yaml", bandwidth=f"{bandwidth} rad/s").analyse()
    assert analysis.limits["motor lag"].value == approx(0.5685 / bandwidth, rel=2e-4)


@pytest.mark.slow
def test_the_yaw_misalignment_that_it_tolerates_is_the_phase_margin_of_vision() -> None:
    analysis = bare("margins.yaml").analyse()
    assert analysis.limits["yaw misalignment"].value == approx(math.radians(43.55), abs=2e-4)
    assert analysis.limits["yaw misalignment"].value == approx(
        analysis.loops["vision"].margins.phase_lag, abs=1e-4
    )
    assert analysis.limits["yaw misalignment"].text == "stable up to 43.55 deg"


def test_a_gain_can_go_to_where_a_pole_comes_to_minus_1(tmp_path) -> None:
    """z^2 + (k T^2/2 + c T - 2) z + k T^2/2 - c T + 1 at z = -1: c T = 2, whatever k is."""
    found = limit(sampled(tmp_path), "damping", "1.5 1/s", "100 1/s")
    assert found.value == approx(2 / 0.05, rel=1e-4)
    assert found.reached and found.text == "stable up to 40 1/s"


@pytest.mark.slow
def test_a_range_may_go_down(tmp_path) -> None:
    """At z on the unit circle c = k T / 2."""
    found = limit(sampled(tmp_path), "damper.factor", "1.5 1/s", "0.01 1/s")
    assert found.value == approx(2 * 0.05 / 2, rel=1e-4)
    assert found.text == "stable down to 0.05 1/s"


def test_a_range_may_hold_no_limit_or_begin_beyond_it(tmp_path) -> None:
    inside = limit(sampled(tmp_path), "damping", "1.5 1/s", "20 1/s")
    assert (inside.value, inside.reached) == (20.0, False)
    assert inside.text == "stable up to 20 1/s and perhaps further"
    beyond = limit(sampled(tmp_path), "damping", "50 1/s", "20 1/s")
    assert math.isnan(beyond.value) and beyond.text == "unstable from 50 1/s on"


@pytest.mark.slow
def test_an_element_of_a_vector_can_be_varied_and_what_ends_the_loop_is_told(tmp_path) -> None:
    """A lean of 0.05 rad against the wind takes an amplitude of three times that, or there is no rest."""
    diagram = quadvis.load(write(tmp_path, """
quadvis: 1
name: windy
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  craft:
    block: plant.lateral
    rate: continuous
    in: {torque: law.torque, acceleration: 0.4905 m/s^2}
  law:
    block: control.nested_saturation
    rate: continuous
    with: {bandwidth: 1 rad/s}
    in:
      position: craft.position
      velocity: craft.velocity
      angle: craft.angle
      angular_rate: craft.angular_rate
"""))  # fmt: skip
    found = limit(diagram, "law.amplitudes[3]", "0.19 rad", "0.01 rad")
    assert found.value == approx(0.15, rel=1e-3)
    assert "no steady state" in found.reason and found.text.startswith("stable down to 0.15 rad; beyond: ")


def test_a_value_that_the_block_does_not_take_is_told_as_for_set(tmp_path) -> None:
    with pytest.raises(DiagramError, match="lag must be at least 0 s, got"):
        limit(bare("margins.yaml"), "lag", "0 s", "-1 s")


def test_a_question_that_names_nothing_is_told() -> None:
    with pytest.raises(
        DiagramError, match=r"^limits: the diagram has no parameter 'lagg'; did you mean 'lag'\?"
    ):
        limit(bare("margins.yaml"), "lagg", "0 s", "1 s")


LARGEST = {  # by vision latency (s): without lag; behind radio and motors; the same without a gyro
    0.05: (8.8, 3.34, 2.47),
    0.1: (6.2, 3.30, 2.49),
    0.2: (3.96, 3.04, 2.40),
    0.3: (2.91, 2.83, 2.27),
    0.4: (2.30, 2.33, 2.18),
}
CASES = [
    (latency, variant, bandwidth)
    for latency, row in LARGEST.items()
    for variant, bandwidth in zip(("ideal", None, "differences"), row, strict=True)
]


@pytest.mark.parametrize(
    ("latency", "variant", "bandwidth"), mostly_slow(CASES[7:] + CASES[:7], quick=0, slow=6)
)
def test_the_sampled_loop_is_stable_up_to_the_known_bandwidth(latency, variant, bandwidth) -> None:
    for factor, stable in ((0.98, True), (1.02, False)):
        settings = {"latency": f"{latency} s", "bandwidth": f"{factor * bandwidth} rad/s"}
        assert bare("sampled_margins.yaml", variant, **settings).analyse().stable is stable


@pytest.mark.slow
@pytest.mark.parametrize(("latency", "variant", "bandwidth"), CASES[::7])
def test_the_largest_stable_bandwidth_is_found(latency, variant, bandwidth) -> None:
    diagram = bare("sampled_margins.yaml", variant, latency=f"{latency} s")
    assert diagram.analyse().limits["bandwidth"].value == approx(bandwidth, rel=0.01)


@pytest.mark.slow
@pytest.mark.parametrize(("lag", "bandwidth"), [(20, 4.6), (200, 2.2)])
def test_the_largest_stable_bandwidth_falls_with_the_motor_lag(lag: int, bandwidth: float) -> None:
    diagram = bare("sampled_margins.yaml", lag=f"{lag} ms")
    assert limit(diagram, "bandwidth", "0.5 rad/s", "12 rad/s").value == approx(bandwidth, rel=0.02)


@pytest.mark.parametrize(
    ("bandwidth", "unstable"),
    mostly_slow([(3.0, 0.25), (1.0, 1.05), (1.5, 0.70), (2.0, 0.50), (2.5, 0.40)], quick=0, slow=2),
)
def test_the_first_unstable_vision_latency_on_a_grid_of_50_ms(bandwidth: float, unstable: float) -> None:
    for latency, stable in ((unstable - 0.05, True), (unstable, False)):
        diagram = bare("sampled_margins.yaml", bandwidth=f"{bandwidth} rad/s", latency=f"{latency} s")
        assert diagram.analyse().stable is stable


@pytest.mark.slow
def test_the_hover_tolerates_as_much_misalignment_as_it_does_in_flight() -> None:
    """With rigid body, drag, lag and a camera: what is stable a little below the limit decays when flown."""
    settings = {
        "control/heading.enabled": "false", "craft.model": "rigid_body", "bandwidth": "1 rad/s",
        "eyes.noise": "0 px", "imu.angle_noise": "0 rad", "imu.drift": "0 rad", "imu.rate_noise": "0 rad/s",
        "gust.rms": "[0 m/s, 0 m/s, 0 m/s]", "craft.initial_position": "[5 cm, 0 m, 1.5 m]",
    }  # fmt: skip
    diagram = bare("hover.yaml", "geometric", **settings)
    found = math.degrees(limit(diagram, "target[3]", "0 deg", "90 deg").value)
    assert 40.0 < found < 60.0
    for angle, decays in ((found - 3.0, True), (found + 3.0, False)):
        turned = {
            "target": f"[0 m, 0 m, 1.5 m, {angle} deg]",
            "craft.initial_attitude": f"[0 rad, 0 rad, {angle} deg]",
        }
        run = bare("hover.yaml", "geometric", **settings, **turned).run()
        times, x = run.times("craft.position"), abs(run["craft.position"][:, 0])
        early, late = x[(times > 30.0) & (times < 60.0)].max(), x[times > 110.0].max()
        assert bool(late < early) is decays


QUIET = {
    "eyes.noise": "0 px", "imu.angle_noise": "0 rad", "imu.drift": "0 rad", "imu.rate_noise": "0 rad/s",
    "gust.rms": "[0 m/s, 0 m/s, 0 m/s]",
}  # fmt: skip


@pytest.mark.long  # half a minute each; the margins of this hover are judged in the second stage
@pytest.mark.parametrize(("delay", "stable"), [("60 ms", True), ("70 ms", False)])
def test_the_fused_hover_tolerates_as_late_a_radio_as_it_does_in_flight(delay: str, stable: bool) -> None:
    """Its filters and its predictor go on reckoning with 22 ms; by 15 s the gains are steady."""
    diagram = bare("hover.yaml", "fused_geometric", **QUIET, **{"radio.delay": delay})
    analysis = diagram.analyse(at=15.0)
    assert analysis.stable is stable
    aside = {"radio.delay": delay, "craft.initial_position": "[1 um, 0 m, 1.5 m]"}
    run = bare("hover.yaml", "fused_geometric", **QUIET, **aside).run()
    times, pitch = run.times("craft.attitude"), abs(run["craft.attitude"][:, 1])
    early, late = (pitch[(times > at) & (times <= at + 5.0)].max() for at in (10.0, 20.0))
    assert bool(late < early) is stable
    if not stable:
        assert math.log(late / early) / 10.0 == approx(analysis.poles[0].real, rel=0.05)
