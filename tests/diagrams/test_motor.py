"""The textbook's DC motor with a PI controller: it is short, and its numbers are python-control's."""

from __future__ import annotations

from pathlib import Path

import control
import numpy as np
import pytest

from quadvis.api import load_text
from quadvis.errors import QuadvisError

SI = """\
quadvis: 1
name: motor
rates: {control: 100 Hz}
solver: {method: ode4, step: 1 ms}
stop_time: 3 s
blocks:
  wanted:
    block: sources.step
    rate: control
    with: {after: 20 rad/s, at: 0.1 s}
  speed_control:
    block: systems.pid
    rate: control
    with: {kp: 0.4 V*s/rad, ki: 1.5 V/rad, lower: -24 V, upper: 24 V, method: forward}
    in: {reference: wanted.y, measurement: {from: motor.y, across: sample}}
  motor:  # armature 0.5 ohm and 5 mH, 0.1 N*m/A, 0.01 kg*m^2, 0.02 N*m*s
    block: systems.transfer_function
    with: {numerator: [0.1], denominator: [5.0e-5, 0.0051, 0.02], gain: 1 rad/s/V}
    in: {u: {from: speed_control.y, across: hold}}
  position:
    block: signal.integrator
    in: {u: motor.y}
"""
PLAIN = SI.replace(" rad/s", "").replace(" V*s/rad", "").replace(" V/rad", " 1/s").replace(" V", "")
PLAIN = PLAIN.replace(", gain: 1/V", "")


def response() -> np.ndarray:
    """Return the speed at the ticks of the controller, from the sampled motor and the sampled PI."""
    motor = control.sample_system(control.tf([0.1], [5e-5, 0.0051, 0.02]), 0.01, method="zoh")
    z = control.tf("z")
    loop = control.feedback((0.4 + 1.5 * 0.01 / (z - 1)) * motor, 1)
    time = 0.01 * np.arange(301)
    return np.asarray(control.forced_response(loop, time, np.where(time >= 0.1 - 1e-9, 20.0, 0.0)).outputs)


@pytest.mark.parametrize("text", [SI, PLAIN], ids=["SI units", "plain numbers"])
def test_it_is_short_and_has_the_numbers_of_python_control(text: str, tmp_path: Path) -> None:
    assert len(text.splitlines()) <= 40
    diagram = load_text(text, tmp_path)
    assert not diagram.warnings
    assert len(diagram.graph.nodes) <= 8
    speed = diagram.run()["motor.y"][::10]
    assert speed == pytest.approx(response(), abs=1e-6)


def test_the_units_of_the_loop_are_the_motor_s(tmp_path: Path) -> None:
    diagram = load_text(SI, tmp_path)
    units = {node.path: str(node.units[port][0]) for node in diagram.graph.nodes for port in ("y",)}
    assert units == {"wanted": "rad/s", "speed_control": "V", "motor": "rad/s", "position": "rad"}


def test_a_system_at_a_rate_asks_for_a_method(tmp_path: Path) -> None:
    wrong = SI.replace(
        "    block: systems.transfer_function\n", "    block: systems.transfer_function\n    rate: control\n"
    )
    with pytest.raises(QuadvisError, match="or choose a 'method' that samples it"):
        load_text(wrong, tmp_path)
