from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.testing import drive
from quadvis_blocks.control.mixer import Mixer
from quadvis_blocks.estimation.predictor import Predictor
from quadvis_blocks.plant.rotorcraft import Rotorcraft
from quadvis_blocks.signal.transport_delay import TransportDelay
from tests.stages import mostly_slow

PARTS = Path(__file__).parents[3] / "diagrams" / "parts"
DELAY, LAG = 0.022, 0.08


def flight() -> tuple[Any, Any]:
    """A craft that is thrown about by commands at 20 Hz behind a radio, seen at 1 kHz; the commands."""
    rng = np.random.default_rng(3)
    wanted = np.repeat(rng.normal(size=(20, 4)) * (0.2, 1.0, 1.0, 0.3), 50, axis=0)
    thrust = drive(
        Mixer(), collective=4.905 + wanted[:, 0], roll=wanted[:, 1], pitch=wanted[:, 2], yaw=wanted[:, 3]
    ).thrust
    sent = drive(TransportDelay(delay=DELAY, initial=4.905 / 4), u=thrust, rate="1 kHz").y
    craft = Rotorcraft(
        model="rigid_body", drag=0.0, torque_bias=(0.05, -0.04, 0.02), initial_attitude=(0.0, 0.0, 0.5)
    )
    return drive(craft, thrust=sent, rate="1 kHz"), thrust


def predict() -> tuple[Any, Any]:
    """The flight, and what a predictor at 20 Hz says at each of its ticks."""
    truth, thrust = flight()
    now = slice(0, 1000, 50)
    attitude, rates = truth.attitude[now], truth.rates[now]
    names = ("roll", "pitch", "yaw")
    found = drive(
        Predictor(delay=DELAY, lag=LAG),
        position=truth.position[now],
        velocity=truth.velocity[now],
        **{name: attitude[:, index] for index, name in enumerate(names)},
        **{f"{name}_rate": rates[:, index] for index, name in enumerate(names)},
        roll_disturbance=0.05,
        pitch_disturbance=-0.04,
        yaw_disturbance=0.02,
        thrust=thrust[now],
        rate="20 Hz",
    )
    return truth, found


def test_it_tells_where_the_simulated_craft_will_be_after_the_radio_and_how_it_will_move() -> None:
    truth, found = predict()
    then = np.arange(22, 1000, 50)
    attitude, rates = truth.attitude[then], truth.rates[then]
    slope = (truth.rates[then + 1] - truth.rates[then - 1]) / 2e-3
    # The tilts are small: the rates of the angles are the body's to second order.
    lead = attitude + LAG * rates
    assert found.later_roll == pytest.approx(lead[:, 0], abs=2e-3)
    assert found.later_pitch == pytest.approx(lead[:, 1], abs=2e-3)
    assert found.later_yaw == pytest.approx(lead[:, 2], abs=2e-3)
    assert found.later_rates == pytest.approx(rates + LAG * slope, abs=5e-3)
    push = (truth.velocity[then + 1] - truth.velocity[then - 1]) / 2e-3
    assert found.later_velocity == pytest.approx(truth.velocity[then] + LAG * push, abs=2e-3)
    assert found.later_position == pytest.approx(truth.position[then] + LAG * truth.velocity[then], abs=2e-4)


LOOP = """
quadvis: 1
name: loop
rates: {{control: 20 Hz}}
solver: {{method: ode4, step: 2 ms}}
stop_time: 10 s
blocks:
  craft:
    block: plant.rotorcraft
    with: {{initial_position: [5 cm, -5 cm, 2 cm], drag: {{value: 0, unit: N*s/m}}, lag: {lag}}}
    in: {{thrust: radio.y}}
  control:
    part: {part}
    rate: control
    with: {{bandwidth: {bandwidth} rad/s}}
    in:
{wires}
      position_reference: {{value: [0, 0, 0], unit: m}}
      yaw_reference: 0 rad
  radio:
    block: signal.transport_delay
    rate: continuous
    with: {{delay: 22 ms, initial: 1.22625 N}}
    in: {{u: {{from: control.thrust, across: hold}}}}
"""
SEEN = {
    "position": "position", "velocity": "velocity", "roll": "attitude[0]", "pitch": "attitude[1]",
    "yaw": "attitude[2]", "roll_rate": "rates[0]", "pitch_rate": "rates[1]", "yaw_rate": "rates[2]",
}  # fmt: skip
NONE = {
    "disturbance": "{value: [0, 0, 0], unit: m/s^2}",
    **{f"{axis}_disturbance": "0 rad/s^2" for axis in ("roll", "pitch", "yaw")},
}


def greatest_at_the_end(folder: Path, part: str, bandwidth: float, lag: str = "80 ms") -> float:
    """The largest distance of a craft from its place in the last two seconds, with a known state."""
    seen = SEEN if part == "fused" else {**SEEN, "rates": "rates"}
    wires = {name: f'{{from: "craft.{port}", across: sample}}' for name, port in seen.items()}
    if part == "fused":
        wires |= NONE
    else:
        wires = {name: wire for name, wire in wires.items() if not name.endswith("_rate")}
    lines = "\n".join(f"      {name}: {wire}" for name, wire in wires.items())
    text = LOOP.format(part=PARTS / f"{part}_control.yaml", bandwidth=bandwidth, wires=lines, lag=lag)
    (folder / "loop.yaml").write_text(text)
    result = quadvis.load(folder / "loop.yaml").run()
    late = result.times("craft.position") >= 8
    return float(np.abs(result["craft.position"][late, :2]).max())


@pytest.mark.parametrize("lag", mostly_slow(["80 ms", "40 ms", "160 ms"]))
def test_with_it_the_laws_of_the_paper_are_stable_at_bandwidths_that_they_cannot_have_without(
    tmp_path: Path, lag: str
) -> None:
    assert greatest_at_the_end(tmp_path, "fused", 7.0, lag) < 1e-3


@pytest.mark.slow
def test_without_it_they_are_not(tmp_path: Path) -> None:
    assert greatest_at_the_end(tmp_path, "paper", 3.0) < 1e-2
    assert greatest_at_the_end(tmp_path, "paper", 4.5) > 1e-2
