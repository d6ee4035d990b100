"""The main parameters of blocks, as a picture has them under the name."""

from __future__ import annotations

import re

import pytest

from quadvis.api import load_text
from quadvis.block import Param
from quadvis.diagram.shown import main_parameters

HEAD = """quadvis: 1
name: shown
rates: {fast: 100 Hz}
solver: {method: ode4, step: 1 ms}
stop_time: 1 s
blocks:
"""
SPEED = "  speed: {block: sources.constant, rate: fast, with: {value: 3 m/s}}\n"


def lines(text: str) -> tuple[str, ...]:
    """What stands under the name of a block ``x`` that a speed feeds."""
    diagram = load_text(f"{HEAD}{SPEED}  x: {text}\n")
    return main_parameters(diagram.graph["x"])


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("{block: signal.gain, rate: fast, with: {factor: -2 N*s/m}, in: {u: speed.y}}", ("-2 N·s/m",)),
        ("{block: signal.gain, rate: fast, with: {factor: 0.125}, in: {u: speed.y}}", ("0.125",)),
        ("{block: signal.low_pass, rate: fast, with: {time_constant: 0.05 s}, in: {u: speed.y}}", ("50 ms",)),
        ("{block: systems.moving_average, rate: fast, with: {samples: 5}, in: {u: speed.y}}", ("5",)),
        ("{block: math.convert, rate: fast, with: {gives: int64}, in: {u: true}}", ("int64",)),
        (
            "{block: signal.saturation, rate: fast, with: {lower: -20 cm/s, upper: 1 m/s}, in: {u: speed.y}}",
            ("lower -0.2 m/s", "upper 1 m/s"),
        ),
        (
            "{block: sources.step, rate: fast, with: {after: 20 deg, at: 100 ms}}",
            ("after 0.3491 rad", "at 100 ms"),
        ),
        (
            "{block: sources.constant, rate: fast, with: {value: {value: [1, 2.5, 0], unit: m/s^2}}}",
            ("[1, 2.5, 0] m/s²",),
        ),
        ("{block: sources.constant, rate: fast, with: {value: [1, 2, 3, 4, 5]}}", ("5 values",)),
        (
            "{block: math.matrix_gain, rate: fast, with: {gain: [[1], [2]]}, in: {u: speed.y}}",
            ("2 x 1 values",),
        ),
        (
            "{block: control.setpoint, rate: fast, with: {target: [0 m, 0 m, 1.5 m, 90 deg]}}",
            ("0 m, 0 m, 1.5 m, 1.571 rad",),
        ),
        ("{block: signal.integrator, in: {u: {from: speed.y, across: hold}}}", ()),
        ("{block: math.dot, rate: fast, in: {a: [1, 2], b: [3, 4]}}", ()),
    ],
)
def test_the_main_parameter_is_short_and_has_its_unit(text: str, found: tuple[str, ...]) -> None:
    assert lines(text) == found


def test_of_several_those_that_do_nothing_are_left_out() -> None:
    gains = "kp: 1 V*s/m, ki: 3 V/m"
    ports = "reference: speed.y, measurement: 1 m/s"
    text = f"{{block: systems.pid, rate: fast, with: {{{gains}}}, in: {{{ports}}}}}"
    assert lines(text) == ("kp 1 V·s/m", "ki 3 V/m")


def test_a_long_text_is_cut() -> None:
    value = "{value: [-1.2345, -2.3456, -3.4567], unit: N*s/m}"
    (line,) = lines(f"{{block: sources.constant, rate: fast, with: {{value: {value}}}}}")
    assert len(line) == 26 and line.endswith("…") and line.startswith("[-1.234, -2.346, -3.457")


def test_the_port_of_a_device_is_always_shown() -> None:
    assert Param(type="port", doc="where").shown and not Param(1.0, doc="a number").shown


def test_a_transfer_function_is_a_small_fraction_in_the_picture() -> None:
    system = "with: {numerator: [2], denominator: [0.5, 0, 1]}, in: {u: {from: speed.y, across: hold}}"
    diagram = load_text(f"{HEAD}{SPEED}  x: {{block: systems.transfer_function, {system}}}\n")
    svg = diagram.draw()
    heights = {
        found[2]: float(found[1])
        for found in re.finditer(r'<text [^>]*?y="([\d.]+)"[^>]*>([^<]*)</text>', svg)
    }
    assert heights["x"] < heights["2"] < heights["0.5 s² + 1"]
    assert "transfer_function</text>" not in svg  # the fraction says it
