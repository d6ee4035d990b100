"""Units that do not fit are reported once, at the value that causes them, without their consequences."""

from __future__ import annotations

import pytest

from quadvis.api import load_text
from quadvis.errors import DiagramError, Fault
from quadvis.errors.rules import INTEGRALS

# A DC motor with a PI controller of its speed.
MOTOR = """\
quadvis: 1
name: motor
rates: {control: 100 Hz}
solver: {method: ode4, step: 1 ms}
stop_time: 1 s
blocks:
  reference: {block: sources.step, rate: control, with: {after: 10 rad/s}}
  sampled: {block: signal.gain, rate: control, in: {u: {from: speed.y, across: sample}}}
  error: {block: signal.difference, rate: control, in: {plus: reference.y, minus: sampled.y}}
  proportional: {block: signal.gain, rate: control, with: {factor: 0.5 V*s/rad}, in: {u: error.y}}
  integral_gain: {block: signal.gain, rate: control, with: {factor: 2 V/rad}, in: {u: error.y}}
  integral: {block: signal.discrete_integrator, rate: control, in: {u: integral_gain.y}}
  voltage: {block: signal.sum, rate: control, in: {u: [proportional.y, integral.y]}}
  limited: {block: signal.saturation, rate: control, with: {lower: -12 V, upper: 12 V},
            in: {u: voltage.y}}
  back_emf: {block: signal.gain, rate: continuous, with: {factor: 0.01 V*s/rad}, in: {u: speed.y}}
  resistive: {block: signal.gain, rate: continuous, with: {factor: 1 ohm}, in: {u: current.y}}
  held: {block: signal.gain, rate: continuous, in: {u: {from: limited.y, across: hold}}}
  coil: {block: signal.difference, rate: continuous, in: {plus: held.y, minus: back_emf.y}}
  net: {block: signal.difference, rate: continuous, in: {plus: coil.y, minus: resistive.y}}
  current_rate: {block: signal.gain, rate: continuous, with: {factor: 2 1/H}, in: {u: net.y}}
  current: {block: signal.integrator, in: {u: current_rate.y}}
  torque: {block: signal.gain, rate: continuous, with: {factor: 0.01 N*m/A}, in: {u: current.y}}
  friction: {block: signal.gain, rate: continuous, with: {factor: 0.1 N*m*s/rad}, in: {u: speed.y}}
  moving: {block: signal.difference, rate: continuous, in: {plus: torque.y, minus: friction.y}}
  acceleration: {block: signal.gain, rate: continuous, with: {factor: 100 rad/(kg*m^2)}, in: {u: moving.y}}
  speed: {block: signal.integrator, in: {u: acceleration.y}}
  angle: {block: signal.integrator, in: {u: speed.y}}
expect:
  - {signal: speed.y, within: 20 rad/s}
"""
ANGLES = (
    "an angle has a dimension of its own here, rad: an inertia is in kg*m^2/rad, "
    "a motor's constant in V*s/rad"
)


def faults(text: str) -> list[Fault]:
    """Return what is wrong with a diagram."""
    try:
        load_text(text)
    except DiagramError as error:
        return error.faults
    return []


def changed(before: str, after: str) -> str:
    """Return the motor with another value."""
    assert MOTOR.count(before) == 1
    return MOTOR.replace(before, after)


def test_the_motor_is_right() -> None:
    assert faults(MOTOR) == []


@pytest.mark.parametrize(
    ("before", "after", "block", "found", "right"),
    [
        ("100 rad/(kg*m^2)", "100 1/(kg*m^2)", "acceleration", "1/kg/m^2", "rad/kg/m^2"),
        ("100 rad/(kg*m^2)", "100 deg/(kg*m)", "acceleration", "rad/kg/m", "rad/kg/m^2"),
        ("0.01 N*m/A", "0.01 N*m", "torque", "N*m", "N*m/A"),
        ("0.01 N*m/A", "0.01 N/A", "torque", "N/A", "N*m/A"),
        ("0.01 N*m/A", "0.01 A/(N*m)", "torque", "A/N/m", "V*s"),
        ("2 1/H", "2 H", "current_rate", "H", "1/H"),
        ("2 1/H", "2 1/F", "current_rate", "1/F", "1/H"),
        ("2 1/H", "2 1/(H*rad)", "current_rate", "1/H/rad", "1/H"),
        ("0.5 V*s/rad", "0.5 V*s", "proportional", "V*s", "V*s/rad"),
        ("0.5 V*s/rad", "0.5 V/rad", "proportional", "V/rad", "V*s/rad"),
        ("after: 10 rad/s", "after: 10 1/s", "reference", "1/s", "rad/s"),
    ],
)
def test_one_value_that_makes_many_wires_wrong_is_one_fault(
    before: str, after: str, block: str, found: str, right: str
) -> None:
    (told,) = faults(changed(before, after))
    assert told.subject == f"block '{block}'"
    assert told.problem.partition(" with which")[0].endswith(f" has {found},")
    assert told.remedy.partition("; ")[0] == f"all fit if it is in {right}"


@pytest.mark.parametrize(
    ("before", "after", "block"),
    [
        ("0.1 N*m*s/rad", "0.1 N*m*s", "moving"),
        ("0.1 N*m*s/rad", "0.1 N*s/rad", "moving"),
        ("1 ohm", "1 V", "net"),
        ("1 ohm", "1 1/ohm", "net"),
        ("0.01 V*s/rad", "0.01 V*s", "coil"),
        ("2 V/rad", "2 V", "voltage"),
        ("2 V/rad", "2 V*s", "voltage"),
    ],
)
def test_one_wire_that_is_wrong_is_told_at_the_wire(before: str, after: str, block: str) -> None:
    (told,) = faults(changed(before, after))
    assert told.subject == f"block '{block}'"
    assert "wire a signal of that unit" in told.remedy


def test_two_values_are_two_faults() -> None:
    text = changed("100 rad/(kg*m^2)", "100 1/(kg*m^2)").replace("2 V/rad", "2 V")
    assert {fault.subject for fault in faults(text)} == {"block 'acceleration'", "block 'voltage'"}


def test_how_angles_count_is_said_once() -> None:
    text = changed("0.1 N*m*s/rad", "0.1 N*m*s").replace("0.01 V*s/rad", "0.01 V*s")
    text = text.replace("2 V/rad", "2 V")
    told = faults(text)
    assert len(told) > 1
    assert sum(ANGLES in fault.remedy for fault in told) == 1


@pytest.mark.parametrize(
    ("before", "after"), [("1 ohm", "1 V"), ("0.01 N*m/A", "0.01 N*m"), ("2 1/H", "2 H")]
)
def test_how_angles_count_is_not_said_of_others(before: str, after: str) -> None:
    assert not any(ANGLES in fault.remedy for fault in faults(changed(before, after)))


def test_a_parameter_that_several_blocks_take_is_one_fault_at_its_value() -> None:
    axes = "".join(
        f"  t{axis}: {{block: sources.step, rate: c, with: {{after: 1 N*m}}}}\n"
        f"  a{axis}: {{block: signal.gain, rate: c, with: {{factor: $inertia}}, in: {{u: t{axis}.y}}}}\n"
        f"  r{axis}: {{block: sources.step, rate: c, with: {{after: 1 rad/s^2}}}}\n"
        f"  d{axis}: {{block: signal.difference, rate: c, in: {{plus: r{axis}.y, minus: a{axis}.y}}}}\n"
        for axis in range(3)
    )
    head = (
        "quadvis: 1\nname: x\nparams: {inertia: 5 1/(kg*m^2)}\nrates: {c: 10 Hz}\nstop_time: 1 s\nblocks:\n"
    )
    (told,) = faults(head + axes)
    assert (told.place.line, told.place.column) == (3, 19)
    assert "with which 3 units do not fit; all fit if it is in rad/kg/m^2" in str(told)


# A rotor in the units of the textbooks, which leave rad out: its speed is in 1/s.
ROTOR = """\
quadvis: 1
name: rotor
solver: {method: ode4, step: 1 ms}
stop_time: 1 s
blocks:
  push: {block: signal.gain, with: {factor: 100 1/(kg*m^2)}, in: {u: 0.1 N*m}}
  speed: {block: signal.integrator, in: {u: push.y}}
expect:
  - {signal: speed.y, below: 20 1/s}
  - {signal: speed.y, of: 0 1/s, within: 20 1/s}
figures: [{title: rotor, panels: [{title: speed, signals: speed.y, unit: 1/s}]}]
"""


def test_the_units_of_textbooks_fit_where_rad_is_nowhere() -> None:
    assert faults(ROTOR) == []


def test_the_first_use_of_rad_says_once_where_it_is_missing() -> None:
    found = faults(ROTOR.replace("1/s", "rad/s"))
    assert [fault.remedy.endswith(ANGLES) for fault in found] == [True, False, False, False]
    assert [fault.remedy.partition(";")[0] for fault in found] == ["write it in 1/s"] * 3 + [
        "give it a panel of its own"
    ]


def test_an_angular_frequency_has_its_turns_in_the_remedy() -> None:
    text = (
        "quadvis: 1\nname: sine\nrates: {c: 1 kHz}\nstop_time: 1 s\nblocks:\n  sine: {block: sources.sine, "
    )
    (fault,) = faults(text + "rate: c, with: {frequency: 120 rad/s}}\n")
    assert fault.remedy == "write it as '120 / (2 * pi) Hz'"
    assert faults(text + "rate: c, with: {frequency: 120 / (2 * pi) Hz}}\n") == []


VDP = """\
quadvis: 1
name: vdp
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  slope: {block: math.expression, with: {y: "mu * (1 - x1^2) * x2 - x1", mu: 1}, in: {x1: x1.y, x2: x2.y}}
  x1: {block: signal.integrator, with: {initial: 2}, in: {u: x2.y}}
  x2: {block: signal.integrator, in: {u: slope.y}}
"""


def test_rates_of_plain_numbers_say_that_time_has_a_unit() -> None:
    found = [fault.remedy for fault in faults(VDP)]
    assert sum(remedy.endswith(INTEGRALS) for remedy in found) == 1
    right = VDP.replace(
        'y: "mu * (1 - x1^2) * x2 - x1"', 'first: k * x2, y: "k * (mu * (1 - x1^2) * x2 - x1)"'
    )
    assert faults(right.replace("mu: 1", "mu: 1, k: 1 1/s").replace("u: x2.y}", "u: slope.first}")) == []


def test_a_speed_for_a_place_is_not_explained_by_it() -> None:
    text = VDP.replace("initial: 2", "initial: 2 m").replace("u: slope.y", "u: 1 m/s^2")
    assert faults(text)
    assert not any(INTEGRALS in fault.remedy for fault in faults(text))
