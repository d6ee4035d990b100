"""Transfer functions from recordings: known systems found again, and what their deviations are worth."""

from __future__ import annotations

import json
from pathlib import Path

import control
import numpy as np
import pytest
from pytest import approx
from scipy.signal import cont2discrete, lfilter

import quadvis
from quadvis.analysis.identified import Identified
from quadvis.analysis.identify import identify
from quadvis.api import load_text
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.output.foreign_signals import ForeignSignals
from tests.stages import mostly_slow

PERIOD = 0.01
MOTOR = ([0.1], [5e-5, 0.0051, 0.02])  # volt to rad/s
TRUE = np.array([2000.0, 102.0, 400.0])


def recording(times: np.ndarray, u: np.ndarray, y: np.ndarray, stride: int = 1) -> ForeignSignals:
    found = ForeignSignals(Path("bench.csv"))
    stamps = np.round(times * 1e9).astype(np.int64)
    found.take("u", "V", stamps, u)
    found.take("y", "rad/s", stamps[::stride], y[::stride])
    return found


def experiment(
    seed: int, system=MOTOR, noise: float = 0.2, count: int = 1500, delay: int = 0, stride: int = 1
) -> ForeignSignals:
    """Return a run at random voltages, with white noise on what is measured, and an offset."""
    random = np.random.default_rng(seed)
    u = np.repeat(random.choice([-2.0, 4.0], count // 5 + 1), 5)[:count]
    above, below, _ = cont2discrete(system, PERIOD)
    late = np.concatenate([np.full(delay, u[0]), u[: count - delay]])
    clean = lfilter(above[0], below, late)
    return recording(
        PERIOD * np.arange(count), u, clean + 0.7 + noise * random.standard_normal(count), stride
    )


def coefficients(found: Identified) -> tuple[np.ndarray, np.ndarray]:
    """Return all free coefficients, and their deviations."""
    own, deviations = (found.numerator, found.denominator), found.deviations
    return np.concatenate([own[0], own[1][1:]]), np.concatenate([deviations[0], deviations[1][1:]])


def test_without_noise_the_system_itself_is_found() -> None:
    found = identify(experiment(1, noise=0.0), input="u", output="y", order=2, zeros=0)
    assert coefficients(found)[0] == approx(TRUE, rel=1e-7)
    assert (found.fit, found.fit_own) == (approx(100.0, abs=1e-6), approx(100.0, abs=1e-6))
    assert sorted(found.poles.real) == approx(sorted(np.roots(MOTOR[1])), rel=1e-7)
    assert str(found.unit) == "rad/s/V"
    assert isinstance(found.system, control.TransferFunction) and found.system.dt == 0


@pytest.mark.parametrize("seed", range(4))
def test_a_noisy_motor_is_found_within_three_deviations(seed: int) -> None:
    found = identify(experiment(seed), input="u", output="y", order=2, zeros=0)
    values, deviations = coefficients(found)
    assert (np.abs(values - TRUE) < 3.0 * deviations).all()
    assert (deviations < 0.1 * TRUE).all()
    assert found.noise == approx(0.2, rel=0.1)
    assert abs(found.colour) < 0.1


@pytest.mark.slow
def test_the_deviations_are_those_of_many_recordings() -> None:
    errors = []
    for seed in range(100, 200):
        values, deviations = coefficients(identify(experiment(seed), input="u", output="y", order=2, zeros=0))
        errors.append((values - TRUE) / deviations)
    found = np.array(errors)
    # Of 100 draws the mean has a deviation of 0.1 and the spread one of 0.07.
    assert np.abs(found.mean(axis=0)).max() < 0.4
    assert (found.std(axis=0) > 0.78).all() and (found.std(axis=0) < 1.22).all()
    assert 0.58 < (np.abs(found) < 1.0).mean() < 0.78


def test_the_discrete_form_is_the_least_squares_of_numpy_where_there_is_no_noise() -> None:
    data = experiment(3, noise=0.0)
    found = identify(data, input="u", output="y", order=2, discrete=True)
    u, y = data["u"], data["y"]
    rows = np.column_stack([u[1:-1], u[:-2], -y[1:-1], -y[:-2], np.ones(u.size - 2)])
    b1, b0, a1, a0, _ = np.linalg.lstsq(rows, y[2:], rcond=None)[0]
    assert found.numerator == approx([b1, b0], rel=1e-7)
    assert found.denominator == approx([1.0, a1, a0], rel=1e-7)
    assert found.system.dt == PERIOD
    exact = control.c2d(control.tf(*MOTOR), PERIOD)
    assert found.system(np.exp(0.3j)) == approx(exact(np.exp(0.3j)), rel=1e-6)


def test_the_pulse_response_is_that_of_python_control() -> None:
    data = experiment(5, ([200.0], [1.0, 30.0, 200.0]), noise=0.0)
    found = identify(data, input="u", output="y", order=2, discrete=True)
    pulses = np.ravel(control.markov(data["y"] - 0.7, data["u"], 150, dt=True))
    wanted = np.asarray(control.impulse_response(found.system, np.arange(60) * PERIOD).outputs) * PERIOD
    assert pulses[:60] == approx(wanted, abs=1e-3 * float(wanted.max()))


@pytest.mark.parametrize("delay", mostly_slow([7, 0]))
def test_a_delay_is_found_to_the_sample(delay: int) -> None:
    found = identify(
        experiment(2, delay=delay, count=900), input="u", output="y", order=2, zeros=0, delay=True
    )
    assert found.delay == approx(delay * PERIOD)
    values, deviations = coefficients(found)
    assert (np.abs(values - TRUE) < 4.0 * deviations).all()


def test_an_output_may_be_sampled_more_slowly_than_the_input() -> None:
    found = identify(experiment(4, stride=3), input="u", output="y", order=2, zeros=0)
    values, deviations = coefficients(found)
    assert (np.abs(values - TRUE) < 3.5 * deviations).all()
    assert sum(found.samples) == 500


@pytest.mark.parametrize(
    "system", [([4.0], [1, 0.4, 4.0]), ([1.0], [1.0, 3.0]), ([1.0, 2.0], [1.0, 2.0, 5.0]), ([3.0], [1, 0])]
)
def test_other_systems_are_found(system) -> None:
    order, zeros = len(system[1]) - 1, len(system[0]) - 1
    data = experiment(6, system, noise=0.01, count=2500)
    found = identify(data, input="u", output="y", order=order, zeros=zeros)
    values, deviations = coefficients(found)
    wanted = np.concatenate([system[0], system[1][1:]])
    assert (np.abs(values - wanted) < 3.5 * deviations).all()
    assert found.fit > 90.0


# A run of quadvis: the motor of the textbook at a random voltage, measured with noise.
BENCH = """
quadvis: 1
name: bench
rates: {control: 100 Hz}
solver: {method: ode4, step: 2 ms}
stop_time: 20 s
blocks:
  drive: {block: sources.prbs, rate: control, with: {order: 10, hold: 5, low: -4 V, high: 6 V}}
  motor:
    block: systems.transfer_function
    with: {numerator: [0.1], denominator: [5.0e-5, 0.0051, 0.02], gain: 1 rad/s/V}
    in: {u: {from: drive.y, across: hold}}
  noise: {block: sources.noise, rate: control, with: {sigma: 0.3 rad/s}}
  speed: {block: signal.sum, rate: control, in: {u: [{from: motor.y, across: sample}, noise.y]}}
"""


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Path:
    log = tmp_path_factory.mktemp("bench") / "bench.mcap"
    load_text(BENCH).run(log=log)
    return log


def test_a_motor_is_found_in_the_log_of_its_run(bench: Path) -> None:
    found = quadvis.identify(bench, input="drive.y", output="speed.y", order=2, zeros=0)
    values, deviations = coefficients(found)
    assert (np.abs(values - TRUE) < 3.5 * deviations).all()
    assert found.noise == approx(0.3, rel=0.1)


def test_the_command_prints_a_block_that_runs(bench: Path, capsys, tmp_path: Path) -> None:
    picture = tmp_path / "fit.png"
    arguments = ["identify", str(bench), "--input", "drive.y", "--output", "speed.y", "--order", "2"]
    assert main([*arguments, "--zeros", "0", "--plot", str(picture)]) == 0
    out = capsys.readouterr().out
    assert "standard deviation" in out and "fit: " in out and picture.read_bytes().startswith(b"\x89PNG")
    block = out.partition("blocks:\n")[2].partition("plot:")[0]
    result = load_text(BENCH + block).run()
    difference = result["model.y"] - result["motor.y"]
    assert np.sqrt(np.mean(difference**2)) < 0.02 * np.sqrt(np.mean(result["motor.y"] ** 2))
    assert main([*arguments, "--zeros", "0", "--json"]) == 0
    facts = json.loads(capsys.readouterr().out)
    assert facts["denominator"] == approx([1.0, 102.0, 400.0], rel=0.1)
    assert len(facts["numerator_deviation"]) == 1 and facts["period_s"] == 0.0


@pytest.mark.parametrize("more", mostly_slow([{"delay": True, "zeros": 0}, {"discrete": True}]))
def test_the_blocks_of_other_forms_run_as_well(more) -> None:
    found = identify(experiment(2, delay=5, count=800), input="u", output="y", order=2, **more)
    rates = f"rates: {{model_rate: {PERIOD} s}}\nsolver: {{method: ode4, step: 10 ms}}\n"
    step = "  u: {block: sources.step, rate: model_rate, with: {after: 2 V, at: 0 s}}\n"
    block = found.block().replace("{from: u", "{from: u.y").replace("{u: u}", "{u: u.y}")
    text = f"quadvis: 1\nname: made\n{rates}stop_time: 3 s\nblocks:\n{step}{block}\n"
    assert load_text(text).run()["model.y"][-1] == approx(2.0 * found.system.dcgain(), rel=1e-3)


# Bad recordings.


def still() -> ForeignSignals:
    times = PERIOD * np.arange(200)
    return recording(times, np.full(200, 3.0), np.sin(times))


def uneven() -> ForeignSignals:
    times = PERIOD * np.arange(200)
    times[100:] += 0.004
    return recording(times, np.sin(7 * times), np.sin(times))


def short() -> ForeignSignals:
    return experiment(1, count=12)


def holes() -> ForeignSignals:
    times = PERIOD * np.arange(200)
    y = np.sin(times)
    y[50] = np.nan
    return recording(times, np.sin(7 * times), y)


def one_sine() -> ForeignSignals:
    times = PERIOD * np.arange(2000)
    return recording(times, np.sin(6 * times), np.cos(6 * times))


@pytest.mark.parametrize(
    ("data", "more", "message"),
    [
        (still, {}, "the input 'u' stands still at 3: nothing can be identified; move it"),
        (uneven, {}, "the samples of 'u' are not evenly spaced, 0.01 s to 0.014 s; bring them to one rate"),
        (short, {"order": 3}, "8 samples to fit 10 coefficients: too few; record longer"),
        (holes, {}, "'y' holds values that are no numbers"),
        (one_sine, {"order": 4}, "the recording does not determine 8 coefficients; take a lower order"),
        (still, {"output": "z"}, "there is no signal 'z'"),
        (still, {"zeros": 3}, "a transfer function of order 2 cannot have 3 zeros"),
        (still, {"validation": 2.0}, "a share of 2 for validation is not between 0 and 0.9"),
    ],
)
def test_a_recording_of_no_use_is_one_sentence(data, more, message) -> None:
    with pytest.raises(QuadvisError) as caught:
        identify(data(), **{"input": "u", "output": "y", "order": 2, **more})
    assert message in str(caught.value)


def test_what_is_not_white_is_remarked_on() -> None:
    data = experiment(1, ([4.0], [1, 0.4, 4.0]), noise=0.01)
    found = identify(data, input="u", output="y", order=1)
    assert any("the residuals are not white" in line for line in found.lines())


def from_rest(delay: int, count: int, stride: int = 1) -> ForeignSignals:
    """Return a recording without noise that begins at rest, while the input is not 0 from its start on."""
    u = np.repeat(np.random.default_rng(4).choice([-2.0, 4.0], count // 10), 10)
    above, below, _ = cont2discrete(([2.0], [1.0, 4.0]), PERIOD)
    y = lfilter(above[0], below, np.concatenate([np.zeros(delay), u[: u.size - delay]]))
    return recording(PERIOD * np.arange(u.size), u, y, stride)


@pytest.mark.parametrize(("stride", "after"), mostly_slow([(1, 0.2), (3, 0.2), (1, 0.0)]))
def test_what_answers_to_inputs_before_the_recording_is_not_fitted(stride: int, after: float) -> None:
    recorded = from_rest(7, 120 * stride, stride)
    found = identify(recorded, input="u", output="y", order=1, delay=True, after=after)
    assert found.delay == approx(7 * PERIOD)
    assert (*found.numerator, found.denominator[1]) == (approx(2.0, rel=1e-9), approx(4.0, rel=1e-9))
    assert (found.fit, found.fit_own) == (approx(100.0, abs=1e-6), approx(100.0, abs=1e-6))
    assert np.isnan(found.simulated[2]).sum() == -(-7 // stride)


@pytest.mark.slow
@pytest.mark.parametrize(("delay", "longest"), [(59, False), (80, True)])
def test_a_dead_time_that_may_be_longer_than_what_is_sought_is_remarked_on(delay: int, longest: bool) -> None:
    found = identify(from_rest(delay, 600), input="u", output="y", order=1, delay=True)
    assert found.delay == approx(min(delay, 60) * PERIOD)
    assert any("it may be longer" in line for line in found.lines()) == longest
