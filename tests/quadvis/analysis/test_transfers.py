"""Transfers against closed forms and python-control: continuous, sampled, and at several rates."""

from __future__ import annotations

import cmath
import json
import math
from pathlib import Path

import control
import numpy as np
import pytest
from pytest import approx

import quadvis
from quadvis.analysis import ways
from quadvis.analysis.analyse import Analysis
from quadvis.analysis.linearise import linearised_part
from quadvis.analysis.loops import AnalysisError
from quadvis.analysis.transfers import Transfers
from quadvis.analysis.verdict import judge_sensitivity, judge_transfer
from quadvis.api import Diagram, load_text
from quadvis.cli import main
from quadvis.diagram.loop_requirements import RequiredSensitivity, RequiredTransfer
from quadvis.errors import DiagramError
from quadvis.machine.files import file_name

from .loops import DIAGRAMS, sampled

# A motor's speed under PI, all of it continuous, and a filter before the wanted speed, which is on no loop.
MOTOR = """
quadvis: 1
name: motor
solver: {method: ode4, step: 1 ms}
stop_time: 1 s
blocks:
  wanted: {block: sources.constant, rate: continuous, with: {value: 2}}
  filter:
    block: systems.transfer_function
    with: {numerator: [1], denominator: [0.05, 1]}
    in: {u: wanted.y}
  error: {block: signal.sum, rate: continuous, with: {signs: +-}, in: {u: [filter.y, motor.y]}}
  pi: {block: systems.transfer_function, with: {numerator: [0.4, 1.5], denominator: [1, 0]}, in: {u: error.y}}
  voltage: {block: signal.sum, rate: continuous, in: {u: [pi.y, 0]}}
  motor:
    block: systems.transfer_function
    with: {numerator: [0.1], denominator: [5.0e-5, 0.0051, 0.02]}
    in: {u: voltage.y}
analyse:
  at: 100 ms
  cuts: {speed: motor.y}
  transfer:
    reference: ["error.u[0]", motor.y]
    filtered: [wanted.y, motor.y]
    load: ["voltage.u[1]", motor.y]
    error: ["error.u[0]", error.y]
    opened: {from: error.y, to: motor.y, open: motor.y}
    plant: {from: motor.u, to: motor.y, open: [motor.y]}
"""
S = control.tf("s")
PI, PLANT = (0.4 * S + 1.5) / S, 0.1 / (5e-5 * S**2 + 0.0051 * S + 0.02)
FORMS = {
    "reference": control.feedback(PI * PLANT),
    "filtered": control.feedback(PI * PLANT) / (0.05 * S + 1),
    "load": control.feedback(PLANT, PI),
    "error": control.feedback(1, PI * PLANT),
    "opened": PI * PLANT,
    "plant": PLANT,
}
GRID = np.geomspace(0.1, 500.0, 40)


@pytest.fixture(scope="module")
def motor() -> Analysis:
    return load_text(MOTOR).analyse()


@pytest.mark.parametrize("name", FORMS)
def test_a_continuous_transfer_is_its_closed_form(motor: Analysis, name: str) -> None:
    system = motor.transfer(name)
    assert isinstance(system, control.StateSpace) and system.dt == 0
    assert system(1j * GRID) == approx(FORMS[name](1j * GRID), rel=1e-6)
    assert system.nstates == {"plant": 2, "filtered": 4}.get(name, 3)
    assert [motor.transfers[name].at(omega) for omega in GRID] == approx(FORMS[name](1j * GRID), rel=1e-6)


def test_a_notebook_shows_an_analysis_in_one_line(motor: Analysis) -> None:
    assert repr(motor) == "<Analysis of motor: 3 states, stable, 1 cut>"


def test_the_names_are_those_of_the_signals(motor: Analysis) -> None:
    system = motor.transfer("load")
    assert (system.input_labels, system.output_labels) == (["voltage:u[1]"], ["motor:y"])
    assert "motor:x[0]" in system.state_labels


@pytest.mark.parametrize("name", ["reference", "filtered", "plant"])
def test_the_numbers_are_those_of_python_control(motor: Analysis, name: str) -> None:
    found, form = motor.transfers[name], FORMS[name]
    step = control.step_info(form, T=np.linspace(0.0, 2.0, 8_001))
    assert found.dc_gain == approx(control.dcgain(form).real, rel=1e-8)
    assert found.bandwidth == approx(control.bandwidth(form), rel=1e-6)
    assert found.peak == approx(np.abs(form(1j * np.geomspace(1e-3, 1e3, 200_001))).max(), rel=1e-7)
    assert found.step.rise_time == approx(step["RiseTime"], rel=2e-3)
    assert found.step.settling_time == approx(step["SettlingTime"], rel=2e-3)
    assert 100.0 * found.step.overshoot == approx(step["Overshoot"], abs=0.01)


def test_the_peaks_of_a_loop_are_those_of_its_sensitivities(motor: Analysis) -> None:
    omega = 1j * np.geomspace(1e-5, 1e4, 200_001)
    peaks = motor.loops["speed"].peaks
    assert peaks.sensitivity == approx(np.abs(FORMS["error"](omega)).max(), rel=1e-7)
    assert peaks.complementary == approx(np.abs(FORMS["reference"](omega)).max(), rel=1e-6)


# The standard form of second order: w^2 / (s^2 + 2 z w s + w^2), with all numbers in closed form.
SECOND = """
quadvis: 1
name: second
solver: {method: ode4, step: 1 ms}
stop_time: 1 s
blocks:
  force: {block: sources.constant, rate: continuous, with: {value: 0}}
  body:
    block: systems.transfer_function
    with: {numerator: [FAST], denominator: [1, DAMPED, FAST]}
    in: {u: force.y}
analyse: {at: 0 s, transfer: {way: [body.u, body.y]}}
"""


@pytest.mark.parametrize("damping", [0.05, 0.2, 0.5, 0.9, 1.0, 3.0])
@pytest.mark.parametrize("omega", [0.7, 40.0])
def test_the_standard_form_has_its_textbook_numbers(damping: float, omega: float) -> None:
    text = SECOND.replace("FAST", repr(omega**2)).replace("DAMPED", repr(2 * damping * omega))
    found = load_text(text).analyse().transfers["way"]
    assert found.dc_gain == approx(1.0, rel=1e-9)
    low = 10 ** (-3 / 20)
    middle = 1 - 2 * damping**2
    assert found.bandwidth == approx(omega * math.sqrt(middle + math.sqrt(middle**2 - 1 + low**-2)), rel=1e-6)
    if damping < math.sqrt(0.5):
        assert found.resonance == approx(1 / (2 * damping * math.sqrt(1 - damping**2)), rel=1e-6)
        assert found.peak_frequency == approx(omega * math.sqrt(middle), rel=1e-4)
    else:
        assert (found.resonance, found.peak_frequency) == (approx(1.0), 0.0)
    beyond = math.exp(-math.pi * damping / math.sqrt(1 - damping**2)) if damping < 1 else 0.0
    assert found.step.overshoot == approx(beyond, abs=2e-4)
    assert found.step.settles and found.step.final == approx(1.0)


@pytest.mark.parametrize("damping", [0.2, 1.0])
def test_the_step_of_the_standard_form_is_its_closed_form(damping: float) -> None:
    text = SECOND.replace("FAST", "9").replace("DAMPED", repr(6 * damping))
    step = load_text(text).analyse().transfers["way"].step
    if damping == 1.0:
        wanted = 1 - (1 + 3 * step.times) * np.exp(-3 * step.times)
    else:
        fast = 3 * math.sqrt(1 - damping**2)
        angle = fast * step.times
        wanted = 1 - np.exp(-3 * damping * step.times) * (
            np.cos(angle) + damping / math.sqrt(1 - damping**2) * np.sin(angle)
        )
    assert step.values == approx(wanted, abs=1e-8)


# Sampled loops.


def discretised(a: np.ndarray, b: np.ndarray, period: float) -> control.StateSpace:
    """Return the exact discretisation of x' = a x + b u, y = x, with a held input."""
    return control.c2d(control.ss(a, b, np.eye(len(a)), np.zeros((len(a), 1))), period, "zoh")


def test_a_sampled_transfer_is_the_exact_discretisation(tmp_path: Path) -> None:
    diagram = sampled(tmp_path)
    system = diagram.analyse(transfers={"way": ("both.u[2]", "push.y")}).transfer("way")
    plant = discretised(np.array([[0, 1], [0, 0]]), np.array([[0], [1]]), 0.05)
    gain = np.array([[2.0, 1.5]])
    closed = control.ss(plant.A - plant.B @ gain, -plant.B, -gain, -1, 0.05)
    assert system.dt == 0.05
    points = np.exp(1j * np.geomspace(0.1, 60.0, 30) * 0.05)
    assert system(points) == approx(closed(points), rel=1e-6)


@pytest.mark.slow
def test_the_pendulum_is_held_as_python_control_says() -> None:
    diagram = quadvis.load(DIAGRAMS / "pendulum.yaml")
    analysis = diagram.analyse(at=4.9, transfers={"move": ("target.u[0]", "state.u[0]")})
    gain = np.atleast_2d(diagram.graph["feedback"].block.gain)
    a = np.array([[0, 1, 0, 0], [0, 0, -1.962, 0], [0, 0, 0, 1], [0, 0, 23.544, 0]])
    plant = discretised(a, np.array([[0], [1], [0], [-2]]), 0.01)
    closed = control.ss(plant.A - plant.B @ gain, plant.B * gain[0, 0], np.eye(4)[:1], 0, 0.01)
    found = analysis.transfers["move"]
    points = np.exp(1j * np.geomspace(0.1, 300.0, 30) * 0.01)
    assert analysis.transfer("move")(points) == approx(closed(points), rel=2e-4)
    step = control.step_info(closed, T=np.arange(0.0, 15.0, 0.01))
    assert found.dc_gain == approx(1.0, abs=1e-6)
    assert found.step.rise_time == approx(step["RiseTime"], abs=1e-9)
    assert found.step.settling_time == approx(step["SettlingTime"], abs=1e-9)
    assert 100.0 * found.step.overshoot == approx(step["Overshoot"], abs=1e-2)


# Four rates: the plant is continuous, an inner loop has 40 Hz, an outer one 10 Hz, the command 20 Hz.
RATES = """
quadvis: 1
name: rates
rates: {fast: 40 Hz, command: 20 Hz, slow: 10 Hz}
solver: {method: ode4, step: 5 ms}
stop_time: 20 s
blocks:
  wave: {block: sources.sine, rate: command, with: {amplitude: SIZE, frequency: FREQUENCY}}
  outer:
    block: signal.sum
    rate: slow
    with: {signs: +-}
    in: {u: [{from: wave.y, across: sample}, {from: place.y, across: sample}]}
  speeds: {block: signal.gain, rate: slow, with: {factor: 2 1/s}, in: {u: outer.y}}
  inner:
    block: signal.sum
    rate: fast
    with: {signs: +-}
    in: {u: [{from: speeds.y, across: hold}, {from: speed.y, across: sample}]}
  push: {block: signal.gain, rate: fast, with: {factor: 8 1/s}, in: {u: inner.y}}
  speed: {block: signal.integrator, rate: continuous, in: {u: {from: push.y, across: hold}}}
  place: {block: signal.integrator, rate: continuous, in: {u: speed.y}}
log: {signals: [place.y, speeds.y, wave.y]}
analyse: {transfer: {way: [wave.y, place.y], mixed: [push.y, speeds.y]}}
"""


def rates(frequency: str = "1 Hz", size: str = "0") -> Diagram:
    text = RATES.partition("log:")
    return load_text(text[0].replace("SIZE", size).replace("FREQUENCY", frequency) + "analyse: {" + WAYS)


WAYS = "transfer: {way: [wave.y, place.y], mixed: [push.y, speeds.y]}}\n"


@pytest.mark.parametrize("frequency", [0.25, 1.0, 4.0])
def test_a_multirate_response_is_what_a_sine_finds(frequency: float) -> None:
    response = rates().analyse().transfers["way"]
    assert response.period == approx(0.1)
    assert [len(times) for times in response.times] == [2, 20]
    result = rates(f"{frequency} Hz", "1").run()
    omega = 2 * math.pi * frequency
    times, values = result.times("place.y"), result["place.y"]
    late = (times >= 12.0 - 1e-9) & (times < 20.0 - 1e-9)  # whole periods, long after the start
    fundamental = 2 * np.mean(values[late] * np.exp(-1j * omega * times[late]))
    sent, at = result["wave.y"], result.times("wave.y")
    late = (at >= 12.0 - 1e-9) & (at < 20.0 - 1e-9)
    driven = 2 * np.mean(sent[late] * np.exp(-1j * omega * at[late]))
    assert response.at(omega) == approx(fundamental / driven, rel=1e-5)


def test_a_multirate_step_is_that_of_a_run() -> None:
    text = RATES.partition("log:")[0].replace(
        "{block: sources.sine, rate: command, with: {amplitude: SIZE, frequency: FREQUENCY}}",
        "{block: sources.step, rate: command, with: {after: 1, at: 2 s}}",
    )
    result = load_text(text).run()
    step = rates().analyse().transfers["way"].step
    values = result["place.y"][result.times("place.y") > 2.0 - 1e-9]
    assert step.sampled
    assert step.values == approx(values[: step.values.size], abs=1e-7)
    assert step.times[:3] == approx([0.0, 0.005, 0.01])


# What is expected of them.


@pytest.mark.parametrize(
    ("kind", "unit", "least"),
    [
        ("bandwidth", "Hz", True), ("bandwidth", "rad/s", True), ("resonance", "dB", False),
        ("rise_time", "ms", False), ("overshoot", "%", False), ("settling_time", "s", False),
        ("peak", "", False),
    ],
)  # fmt: skip
def test_a_requirement_is_met_up_to_what_is_found(kind: str, unit: str, least: bool) -> None:
    text = SECOND.replace("FAST", "9").replace("DAMPED", "1.8")
    analysis = load_text(text).analyse()
    response = analysis.transfers["way"]
    found = getattr(response.step if hasattr(response.step, kind) else response, kind)
    for share, met in ((0.999, least), (1.001, not least)):
        verdict = judge_transfer(RequiredTransfer(response.transfer, kind, share * found, unit), response)
        assert (verdict.found, verdict.met, verdict.lack) == (found, met, "")


def test_requirements_are_read_in_their_units_and_judged(tmp_path: Path, capsys) -> None:
    expected = """
expect:
  - {transfer: reference, bandwidth: 1 Hz, overshoot: 5 %, settling_time: 900 ms, resonance: 1 dB}
  - {transfer: load, peak: 0.001}
  - {sensitivity: speed, below: 6 dB}
  - {complementary_sensitivity: speed, below: 1.05}
"""
    path = tmp_path / "motor.yaml"
    path.write_text(MOTOR + expected)
    found = quadvis.load(path).loop_requirements
    assert [(each.kind, each.bound) for each in found] == [
        ("bandwidth", approx(2 * math.pi)), ("resonance", approx(10 ** (1 / 20))),
        ("overshoot", approx(0.05)), ("settling_time", approx(0.9)), ("peak", 0.001),
        ("sensitivity", approx(10 ** (6 / 20))), ("complementary_sensitivity", 1.05),
    ]  # fmt: skip
    assert main(["analyse", str(path), "--json"]) == 1
    facts = json.loads(capsys.readouterr().out)
    assert [each["met"] for each in facts["expect"]] == [True, True, True, True, False, True, True]
    assert facts["transfers"]["load"]["dc_gain"] == 0.0 and facts["transfers"]["load"]["bandwidth"] is None
    assert facts["cuts"]["speed"]["sensitivity_peak"] == approx(1.0, abs=0.2)
    assert main(["analyse", str(path)]) == 1
    out = capsys.readouterr().out
    assert "NOT MET  load: peak at most 0.001" in out
    assert "met      speed: peak of sensitivity below 6 dB" in out
    assert "does not settle" in out.partition("  opened ")[2].partition("\n")[0]


def test_a_sensitivity_is_judged_by_its_peak(motor: Analysis) -> None:
    loop, cut = motor.loops["speed"], motor.diagram.questions.cuts[0]
    for share, met in ((0.999, False), (1.001, True)):
        asked = RequiredSensitivity(cut, "sensitivity", share * loop.peaks.sensitivity, "")
        assert judge_sensitivity(asked, loop).met is met


def test_what_does_not_settle_meets_nothing(motor: Analysis) -> None:
    opened = motor.transfers["opened"]
    assert math.isinf(opened.dc_gain) and math.isnan(opened.bandwidth) and not opened.stable
    verdict = judge_transfer(RequiredTransfer(opened.transfer, "bandwidth", 1.0, "Hz"), opened)
    assert (verdict.met, verdict.lack) == (False, "the response to a step does not settle")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("transfer: {way: [motor.y]}", "transfer 'way' goes from one signal to another one"),
        ("transfer: {way: motor.y}", "transfer 'way' goes from one signal to another one"),
        ("transfer: {way: [motor.u, motor.z]}", "block 'motor' has no output 'z'"),
        ("transfer: {way: [nobody.u, motor.y]}", "there is no block 'nobody'"),
        ("transfer: {way: [motor, motor.y]}", "'motor' is not a signal"),
        ("transfer: {way: {from: motor.u}}", "'to' is missing"),
        ("transfer: {way: ['motor.u[1]', motor.y]}", "index [1] does not fit 'motor.u'"),
        ("transfer: {way: [motor.u, motor.y]}\nexpect: [{transfer: wag, rise_time: 1 s}]",
         "there is no transfer 'wag'; did you mean 'way'?"),
        ("transfer: {way: [motor.u, motor.y]}\nexpect: [{transfer: way}]",
         "nothing is expected of the transfer"),
        ("transfer: {way: [motor.u, motor.y]}\nexpect: [{transfer: way, bandwidth: 3 s}]", "'bandwidth'"),
        ("cuts: {one: motor.y}\nexpect: [{sensitivity: one}]", "nothing is expected of the sensitivity"),
        ("cuts: {one: motor.y}\nexpect: [{sensitivity: two, below: 2}]", "there is no cut 'two'"),
        ("cuts: {one: motor.y}\nexpect: [{sensitivity: one, below: 0.5}]", "a factor above 1"),
    ],
)  # fmt: skip
def test_a_wrong_question_is_one_sentence(line: str, message: str) -> None:
    first, _, rest = line.partition("\n")
    with pytest.raises(DiagramError) as caught:
        load_text(f"{MOTOR.partition('analyse:')[0]}analyse:\n  {first}\n{rest}\n")
    assert message in str(caught.value) and len(caught.value.faults) == 1


def test_a_signal_of_several_numbers_needs_an_index() -> None:
    diagram = quadvis.load(DIAGRAMS / "pendulum.yaml")
    with pytest.raises(DiagramError, match=r"'state\.y' has 4 numbers; choose one, such as state\.y\[0\]"):
        diagram.analyse(transfers={"way": ("place.y", "state.y")})


def test_a_way_that_leads_nowhere_is_refused(motor: Analysis) -> None:
    diagram = motor.diagram
    found = diagram.questions.more_transfers({"back": ["motor.y", "filter.y"]})[-1]
    with pytest.raises(AnalysisError, match=r"no way leads from 'motor\.y' to 'filter\.y'"):
        Transfers(diagram.graph, [found], 0.1)["back"]
    with pytest.raises(AnalysisError, match="there is no transfer 'referenc'; did you mean 'reference'"):
        motor.transfer("referenc")


# A continuous plant under a sampled law, a filter at another rate, and a lag that is on no loop.
RHYTHMS = """
quadvis: 1
name: rhythms
rates: {law: 20 Hz, slow: 4 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  law: {block: signal.gain, rate: law, with: {factor: -2 1/s}, in: {u: {from: plant.y, across: sample}}}
  push: {block: signal.gain, rate: law, with: {factor: 1}, in: {u: law.y}}
  plant: {block: signal.integrator, in: {u: {from: push.y, across: hold}}}
  slow: {block: signal.unit_delay, rate: slow, in: {u: {from: plant.y, across: sample}}}
  wanted: {block: sources.constant, rate: continuous, with: {value: 1 m}}
  lag: {block: systems.transfer_function, with: {numerator: [1], denominator: [0.1, 1]}, in: {u: wanted.y}}
  edge:
    block: signal.relay
    rate: law
    with: {on_at: 0 s, off_at: 0 s}
    in: {u: {from: plant.y, across: sample}}
  after: {block: signal.discrete_integrator, rate: law, in: {u: edge.y}}
analyse:
  at: 100 ms
  transfer:
    push: [push.y, plant.y]
    back: [plant.y, law.y]
    open: {from: law.y, to: plant.y, open: law.y}
    slow: [push.y, slow.y]
    lag: [wanted.y, lag.y]
"""


def asked(monkeypatch: pytest.MonkeyPatch) -> list[list[str]]:
    """Note of which signals the matrices are found, each time."""
    found: list[list[str]] = []

    def noted(graph, blocks, cuts, at, engine):
        found.append([cut.label for cut in cuts])
        return linearised_part(graph, blocks, cuts, at, engine)

    monkeypatch.setattr(ways, "linearised_part", noted)
    return found


def test_transfers_of_one_rhythm_are_linearised_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls, analysis = asked(monkeypatch), load_text(RHYTHMS).analyse()
    together = {name: analysis.transfers[name] for name in analysis.transfers}
    assert [len(names) for names in calls] == [3, 2, 2]  # two signals are ends of several transfers
    for name, found in together.items():
        question = next(each for each in analysis.diagram.questions.transfers if each.label == name)
        alone = Transfers(analysis.diagram.graph, [question], 0.1)[name]
        assert found.period == alone.period == {"slow": 0.25, "lag": 0.0}.get(name, 0.05)
        assert len(found.states) == len(alone.states)
        for one, other in zip(found.matrices, alone.matrices, strict=True):
            assert one == approx(other, rel=1e-9, abs=1e-9)


def test_one_that_cannot_be_linearised_leaves_the_others_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    text = RHYTHMS.replace("    push:", "    edge: [push.y, after.y]\n    push:")
    calls, analysis = asked(monkeypatch), load_text(text).analyse()
    with pytest.raises(AnalysisError, match=r"no steady state was found|has an edge"):
        analysis.transfers["edge"]
    assert analysis.transfers["push"].period == 0.05
    assert analysis.transfers["back"].period == 0.05
    assert [len(names) for names in calls] == [4, 2, 2, 2]


@pytest.mark.slow
def test_more_transfers_come_by_the_command_line_and_are_drawn(tmp_path: Path, capsys) -> None:
    path = tmp_path / "motor.yaml"
    path.write_text(MOTOR.partition("  transfer:")[0])
    options = [
        "--transfer",
        "one=filter.y,motor.y",
        "--transfer",
        "motor.u,motor.y",
        "-o",
        str(tmp_path / "p"),
    ]
    assert main(["analyse", str(path), *options]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines() if " % " in line] == ["one"]
    drawn = ["bode-speed", "nyquist-speed", "bode-one", "step-one"]
    drawn += [f"{kind}-{file_name('motor.u,motor.y')}" for kind in ("bode", "step")]
    names = {file.name for file in (tmp_path / "p").iterdir()}
    assert names == {f"motor-{name}.png" for name in drawn}


# A plant with a dead time under PI, all at one rate; a step of the reference goes through the dead time last.
DEAD_TIME = """
quadvis: 1
name: dead_time
params: {delay: 4 s, kp: 0.5, ki: 0.1 1/s}
rates: {control: 5 Hz}
stop_time: 1 s
blocks:
  wanted: {block: sources.constant, rate: control, with: {value: 0}}
  pi:
    block: systems.pid
    rate: control
    with: {kp: $kp, ki: $ki, method: backward}
    in: {reference: wanted.y, measurement: READ}
  plant:
    block: systems.transfer_function
    rate: control
    with: {numerator: [2], denominator: [5, 1], method: zoh}
    in: {u: pi.y}
  late: {block: signal.transport_delay, rate: control, with: {delay: $delay}, in: {u: plant.y}}
  later: {block: signal.gain, rate: control, in: {u: late.y}}
analyse:
  cuts: {control: pi.y}
  transfer: {reference: [wanted.y, later.y]}
"""


def dead_time(gain: float) -> control.TransferFunction:
    """Return the loop of `DEAD_TIME` without its dead time."""
    z = control.tf([1, 0], [1], 0.2)
    law = gain * (0.5 + 0.1 * 0.2 * z / (z - 1))
    return law * control.sample_system(control.tf([2], [5, 1]), 0.2, "zoh")


@pytest.mark.parametrize("gain", [0.4, 0.8, 3.0])
def test_a_dead_time_that_is_longer_than_the_time_of_the_steady_state_is_in_the_loop(gain: float) -> None:
    gains = f"kp: {0.5 * gain}, ki: {0.1 * gain}"
    text = DEAD_TIME.replace("READ", "late.y").replace("kp: 0.5, ki: 0.1", gains)
    found = load_text(text).analyse()
    opened = dead_time(gain) * control.tf([1], [1] + 20 * [0], 0.2)
    assert found.stable == (largest_pole(opened) < 1.0) == (gain < 3.0)
    if found.stable:
        margins = found.loops["control"].margins
        crossed = complex(opened(np.exp(0.2j * margins.crossover)))
        assert abs(crossed) == approx(1.0, abs=1e-6)
        assert margins.phase_lag == approx(math.pi + cmath.phase(crossed), abs=1e-6)
        assert largest_pole(margins.gain_up * opened) == approx(1.0, abs=1e-6)


def largest_pole(opened: control.TransferFunction) -> float:
    """Return the magnitude of the largest pole of a loop that is closed."""
    return float(np.abs(control.feedback(opened).poles()).max())


@pytest.mark.parametrize("delay", [1.0, 4.0])
def test_a_step_through_a_dead_time_behind_the_loop_takes_the_time_of_python_control(delay: float) -> None:
    """The many poles at 0 of the dead time are no part of the answer."""
    text = DEAD_TIME.replace("READ", "plant.y").replace("delay: 4 s", f"delay: {delay} s")
    step = load_text(text).analyse().transfers["reference"].step
    closed = control.feedback(dead_time(1.0))
    alone = control.step_info(closed, T=np.arange(0.0, 60.0, 0.2))
    assert step.rise_time == approx(alone["RiseTime"], abs=1e-9)
    assert step.settling_time == approx(alone["SettlingTime"] + delay, abs=1e-9)
    assert 100.0 * step.overshoot == approx(alone["Overshoot"], abs=1e-3)


def test_a_step_that_ends_far_below_its_height_settles_when_it_is_there() -> None:
    """(s + 0.001) / ((s + 1) (s + 2)): 0.0005 + 0.999 exp(-t) - 0.9995 exp(-2 t)."""
    text = """
quadvis: 1
name: lead
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  force: {block: sources.constant, rate: continuous, with: {value: 0}}
  lead:
    block: systems.transfer_function
    with: {numerator: [1, 0.001], denominator: [1, 3, 2]}
    in: {u: force.y}
analyse:
  transfer: {lead: [force.y, lead.y]}
"""
    step = load_text(text).analyse().transfers["lead"].step
    time = np.linspace(5.0, 15.0, 1_000_001)
    away = np.abs(0.999 * np.exp(-time) - 0.9995 * np.exp(-2.0 * time)) >= 0.02 * 0.0005
    assert step.settling_time == approx(time[np.flatnonzero(away)[-1]], abs=1e-3)
