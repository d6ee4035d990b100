"""Tests of the block fmi.fmu, with small FMUs that are compiled here, against fmpy and closed forms."""

from __future__ import annotations

import math
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import quadvis
from quadvis.api import load, load_text
from quadvis.block import ParameterError
from quadvis.errors import DiagramError, RunError
from quadvis.fmi.unpacked import PREFIX
from quadvis.testing import check_block, drive
from quadvis_blocks.fmi.fmu import Fmu
from tests.fmus import models
from tests.fmus.builder import Model, Var, fmu, needs_gcc
from tests.processes import gone, wait_for

pytestmark = needs_gcc
BOTH = pytest.mark.parametrize("version", [2, 3])
EACH = pytest.mark.parametrize("isolation", ["none", "process"])


def made(model: Model, version: int = 2, isolation: str = "none", **given: Any) -> Fmu:
    return Fmu(file=fmu(model, version), isolation=isolation, **given)


def by_fmpy(
    model: Model, version: int, stop: float, step: float, inputs: Any = None, **start: float
) -> NDArray[Any]:
    """Return what fmpy makes of an FMU in co-simulation."""
    from fmpy import simulate_fmu

    return simulate_fmu(  # type: ignore[no-any-return]
        fmu(model, version), stop_time=stop, step_size=step, output_interval=step,
        fmi_type="CoSimulation", start_values=start, input=inputs,
    )  # fmt: skip


@BOTH
@EACH
@pytest.mark.parametrize(
    "model", [models.DAHLQUIST, models.VAN_DER_POL, models.BALL, models.STAIR], ids=lambda each: each.name
)
def test_it_gives_what_fmpy_gives(model: Model, version: int, isolation: str) -> None:
    if version == 3:
        model = replace(model, root="")
    found = drive(made(model, version, isolation), rate="20 Hz", steps=61)
    wanted = by_fmpy(model, version, 3.0, 0.05)
    for name in wanted.dtype.names[1:]:
        assert getattr(found, name) == pytest.approx(wanted[name], rel=1e-12, abs=1e-12), name


@BOTH
def test_model_exchange_is_integrated_by_our_solver(version: int) -> None:
    block = made(models.DAHLQUIST, version, kind="model_exchange", k=2.0, x_start=3.0)
    assert block.interface.continuous[0].signal.shape == (1,)
    found = drive(block, rate="100 Hz", steps=101).x
    assert found == pytest.approx(3.0 * np.exp(-2.0 * np.arange(101) / 100), rel=1e-8)


@BOTH
def test_in_model_exchange_an_input_follows_its_wire_between_ticks(version: int) -> None:
    """The integral of sin t, which a held input would miss by some percent."""
    text = f"""
quadvis: 1
name: trial
solver: {{method: ode4, step: 100 ms}}
stop_time: 2 s
blocks:
  wave: {{block: sources.sine, rate: continuous, with: {{amplitude: 1, frequency: 0.5 Hz}}}}
  sum:
    block: fmi.fmu
    with: {{file: {fmu(models.INTEGRATOR, version)}, kind: model_exchange}}
    in: {{u: wave.y}}
"""
    result = load_text(text, Path()).run()
    time = result.times("sum.x")
    assert result["sum.x"] == pytest.approx((1.0 - np.cos(math.pi * time)) / math.pi, abs=1e-5)


@pytest.mark.parametrize(
    ("model", "version", "words"),
    [
        (
            models.BALL,
            2,
            "model exchange with state events is not possible here, and it has 1; take its co-sim",
        ),
        (replace(models.FEEDTHROUGH2, interfaces=("ModelExchange",)), 2, "its input 'n_in' is discrete"),
        (models.CLOCKS, 3, "it can only be scheduled by its clocks"),
        (replace(models.STAIR, interfaces=()), 2, "it offers neither co-simulation nor model exchange"),
        (models.STAIR, 2, "it offers co-simulation, not model exchange"),
    ],
    ids=["state events", "discrete input", "clocks", "nothing", "no exchange"],
)
def test_what_cannot_be_run_is_refused(model: Model, version: int, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        made(
            model,
            version,
            kind="auto" if model.name == "Clocks" or not model.interfaces else "model_exchange",
        )


@BOTH
@pytest.mark.parametrize(
    "change", [{"time_event": "1"}, {"completed": "return TIME > 0.15;"}], ids=["of time", "of a step"]
)
def test_an_event_in_model_exchange_ends_the_run(version: int, change: dict[str, str]) -> None:
    block = made(replace(models.DAHLQUIST, **change), version, kind="model_exchange")  # type: ignore[arg-type]
    with pytest.raises(RunError, match="has an event, which model exchange here cannot handle"):
        drive(block, rate="10 Hz", steps=5)


# D32


@BOTH
def test_held_signals_stay_held_whatever_the_step(version: int) -> None:
    """1300 from 500 s to 1000 s has the integral 650,000 for every step; the value after the event counts."""
    found = {}
    for seconds in (1, 10):
        time_of = np.arange(0, 1501, seconds)
        inputs = np.where((time_of >= 500) & (time_of < 1000), 1300.0, 0.0)
        block = made(models.INTEGRATOR, version)
        found[seconds] = drive(block, rate=f"{seconds} s", u=inputs).x
    assert found[1][-1] == pytest.approx(650_000.0, rel=1e-9)
    assert found[1][::10] == pytest.approx(found[10], rel=1e-9)
    assert found[1][[499, 500, 501]].tolist() == [0.0, 0.0, 1300.0]


def test_the_last_step_does_not_pass_the_stop_time() -> None:
    last = Model("Last", [Var("y", causality="output")], step="v_y = TIME + h;", interfaces=("CoSimulation",))
    text = """
quadvis: 1
name: trial
rates: {{fast: 10 Hz, slow: 0.4 s}}
stop_time: 1 s
blocks:
  a: {{block: fmi.fmu, rate: fast, with: {{file: {0}, isolation: none}}}}
  b: {{block: fmi.fmu, rate: slow, with: {{file: {0}, isolation: none}}}}
"""
    run = load_text(text.format(fmu(last)), Path()).start()
    with run:
        run._engine.end_before(run.diagram.ticks)
        run.advance("1 s")
        run.advance()
        blocks = [run._engine.bound(name) for name in "ab"]
        assert [block.steps for block in blocks] == [10, 2]
        assert [block._fmu.outputs() for block in blocks] == pytest.approx([1.0, 0.8])


# D33


@BOTH
def test_temperatures_and_angles_have_si_units_on_wires(version: int) -> None:
    block = made(models.UNITS, version)
    assert {name: port.unit for name, port in block.interface.inputs.items()} == {
        "T": "K", "dT": "K", "omega": "rad/s"
    }  # fmt: skip
    found = drive(block, rate="10 Hz", T=[278.15] * 2, dT=[5.0] * 2, omega=[math.radians(57.3)] * 2)
    assert [found.T_raw[1], found.dT_raw[1], found.omega_raw[1]] == pytest.approx([5.0, 5.0, 57.3])
    assert [found.T_out[1], found.dT_out[1], found.omega_out[1]] == pytest.approx(
        [278.15, 5.0, 1.0], rel=1e-4
    )
    assert block.interface.params["limit"].default == pytest.approx(373.15)
    with pytest.raises(ParameterError, match=r"limit must be at most 473\.15 K, got 500 K"):
        made(models.UNITS, version, limit=500.0)


def test_a_wire_of_another_unit_is_a_fault() -> None:
    text = f"""
quadvis: 1
name: trial
rates: {{fast: 10 Hz}}
stop_time: 1 s
blocks:
  size: {{block: sources.constant, rate: fast, with: {{value: 2 m}}}}
  fmu: {{block: fmi.fmu, rate: fast, with: {{file: {fmu(models.UNITS)}, limit: 150 s}}, in: {{T: size.y}}}}
"""
    with pytest.raises(DiagramError) as caught:
        load_text(text, Path())
    found = [str(fault) for fault in caught.value.faults]
    assert any("'150 s' is in s, not in K" in line for line in found), found
    with pytest.raises(DiagramError, match=r"input 'T' takes K, 'size\.y' has m"):
        load_text(text.replace("limit: 150 s", "limit: 300 K"), Path())


def with_unit(unit: str, definition: str = "") -> Model:
    port = Var("u", causality="input", start=3.0, unit=unit)
    return Model("Odd", [port], units=definition or f'<Unit name="{unit}"/>', interfaces=("CoSimulation",))


@pytest.mark.parametrize(
    ("model", "units", "found"),
    [
        (with_unit("furlong"), "", "the unit 'furlong', which is not known; say what it is"),
        (with_unit("furlong"), "furlong = 201.168 m", ("m", 603.504)),
        (with_unit("furlong"), "u = 2 m", ("m", 6.0)),
        (
            with_unit("furlong"),
            "furlog = 201.168 m",
            "no unit and no variable 'furlog'.*did you mean 'furlong'",
        ),
        (with_unit("furlong"), "furlong: 2 m", "does not say what a unit is"),
        (with_unit("deg"), "", ("rad", math.radians(3.0))),
        (
            with_unit("deg", '<Unit name="deg"><BaseUnit rad="1" factor="57.29578"/></Unit>'),
            "",
            "but it is 0.01745",
        ),
        (
            with_unit("deg", '<Unit name="deg"><BaseUnit rad="1" factor="57.29578"/></Unit>'),
            "deg = deg",
            ("rad", math.radians(3.0)),
        ),
        (with_unit("yard", '<Unit name="yard"><BaseUnit m="1" factor="0.9144"/></Unit>'), "", ("m", 2.7432)),
        (with_unit("rad/s", '<Unit name="rad/s"><BaseUnit s="-1"/></Unit>'), "", ("rad/s", 3.0)),
        (
            with_unit("mole", '<Unit name="mole"><BaseUnit mol="1"/></Unit>'),
            "",
            "contains mol; say as what it counts",
        ),
        (with_unit("N.m"), "", ("N*m", 3.0)),
    ],
)
def test_units_are_known_or_confirmed_or_refused(model: Model, units: str, found: Any) -> None:
    if isinstance(found, str):
        with pytest.raises(ParameterError, match=found):
            made(model, units=units)
        return
    port = made(model, units=units).interface.inputs["u"]
    assert (port.unit, port.default) == (found[0], pytest.approx(found[1]))


# D34


@BOTH
@EACH
def test_resources_are_found_in_a_folder_of_any_name_and_by_two_at_once(
    version: int, isolation: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    home = tmp_path / "a b" / "ü#%41"
    home.mkdir(parents=True)
    monkeypatch.setattr("tempfile.tempdir", str(home))
    file = home / "r ü#%20.fmu"
    file.write_bytes(Path(fmu(models.RESOURCE, version)).read_bytes())
    text = f"""
quadvis: 1
name: trial
rates: {{fast: 10 Hz}}
stop_time: 0.2 s
blocks:
  one: {{block: fmi.fmu, rate: fast, with: {{file: "{file.name}", isolation: {isolation}}}}}
  two: {{block: fmi.fmu, rate: fast, with: {{file: "{file.name}", isolation: {isolation}}}}}
"""
    result = load_text(text, home).run()
    assert result["one.y"].tolist() == result["two.y"].tolist() == [ord("a")] * 3
    assert list(home.iterdir()) == [file]


HANGING = """
import sys
sys.path[:0] = {path!r}
from quadvis.testing import check_block, drive
from quadvis_blocks.fmi.fmu import Fmu
drive(Fmu(file={file!r}, deadline=100.0), rate="10 Hz", steps=100000000)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, pytest.param(signal.SIGKILL, marks=pytest.mark.slow)])
def test_the_copy_is_removed_after_ctrl_c_and_after_a_kill(number: signal.Signals, tmp_path: Path) -> None:
    program = HANGING.format(path=sys.path, file=fmu(replace(models.STAIR, step="for (;;) usleep(1000);")))
    process = subprocess.Popen(
        [sys.executable, "-c", program], stderr=subprocess.PIPE, env={**os.environ, "TMPDIR": str(tmp_path)}
    )
    wait_for(lambda: list(tmp_path.glob(f"{PREFIX}*")))
    (worker, *_) = wait_for(lambda: children(process.pid))
    if number == signal.SIGINT:
        time.sleep(0.2)
    process.send_signal(number)
    process.communicate(timeout=60)
    wait_for(lambda: not list(tmp_path.iterdir()))
    wait_for(lambda: gone(worker))


def children(process: int) -> list[int]:
    return [int(each) for each in Path(f"/proc/{process}/task/{process}/children").read_text().split()]


# D35


@BOTH
def test_communication_points_are_the_nearest_doubles(version: int) -> None:
    """At 7 Hz; the FMU refuses a step that begins anywhere else, so sums of periods fail at the third one."""
    found = drive(made(models.EXACT_TIME, version), rate="7 Hz", steps=5000).time_seen
    assert found[1:].tolist() == [k / 7 for k in range(4999)]


def test_no_error_after_ten_million_steps() -> None:
    from quadvis.fmi.plan import instants

    for period, start, exact in ((0.1, 0.0, "k/10"), (1 / 30, 0.0, "k/30"), (1 / 44100, 0.5, "")):
        first, each, denominator = instants(start, period)
        for k in (1, 3, 29, 10**7, 10**7 + 1):
            time_at = (first + k * each) / denominator
            if exact:
                assert time_at == k / int(exact[2:])
            else:
                assert time_at == (22050 + k) / 44100


def test_the_start_time_is_the_fmus_own() -> None:
    shown = Model("Shown", [Var("y", causality="output")], step="v_y = TIME;", interfaces=("CoSimulation",))
    assert drive(made(shown, start_time=3.5), rate="2 Hz", steps=4).y.tolist() == [0.0, 3.5, 4.0, 4.5]


# Ports, parameters, states


def test_ports_have_the_types_and_names_of_the_file() -> None:
    block = made(models.FEEDTHROUGH3, 3)
    assert {name: str(port.signal) for name, port in block.interface.outputs.items()} == {
        "y": "float64", "f_out": "float64", **{f"{kind}_out": "int64" for kind in models.WHOLE},
        "b_out": "bool", "length": "int64", "w": "float64[3]",
    }  # fmt: skip
    assert block.interface.inputs["v"].default == [1.0, 2.0, 3.0]
    odd = Model(
        "Odd",
        [
            Var("body.frame[1].r", causality="output"), Var("body_frame_1_r", causality="output"),
            Var("time.constant", causality="parameter", start=1.0, variability="fixed"),
            Var("close", causality="parameter", start=1.0, variability="fixed"),
            Var("file", causality="parameter", start=1.0, variability="fixed"),
            Var("7", causality="output"), Var("'ä ö'", causality="output"),
        ],
        interfaces=("CoSimulation",),
    )  # fmt: skip
    ports = made(odd).interface
    assert list(ports.outputs) == ["body_frame_1_r", "body_frame_1_r_2", "v_7", "v"]
    assert list(ports.params)[-3:] == ["time_constant", "close_2", "file_2"]
    assert ports.params["close_2"].doc == "parameter of the FMU (close)"


@EACH
@BOTH
def test_every_type_goes_in_and_comes_out(version: int, isolation: str) -> None:
    model = models.FEEDTHROUGH2 if version == 2 else models.FEEDTHROUGH3
    vectors = np.arange(9.0).reshape(3, 3)
    given: dict[str, Any] = {"u": [1.5, -2.5, 0.0], "b_in": [True, False, True], "v": vectors}
    wanted = {"y": "u", "b_out": "b_in", "w": "v"}
    if version == 2:
        given["n_in"], wanted["n_out"] = [-(2**31), 2**31 - 1, 5], "n_in"
    else:
        given["f_in"], wanted["f_out"] = [0.5, -0.25, 3.0], "f_in"
        for kind, (least, most) in models.LIMITS.items():
            given[f"{kind}_in"], wanted[f"{kind}_out"] = [least, min(most, 2**63 - 1), 1], f"{kind}_in"
    found = drive(made(model, version, isolation, text="hällo"), rate="10 Hz", **given)
    for output, name in wanted.items():
        assert np.array_equal(getattr(found, output)[1:], np.asarray(given[name])[:-1]), output
    assert found.length.tolist() == [6, 6, 6]


def test_a_number_that_does_not_fit_ends_the_run() -> None:
    with pytest.raises(RunError, match="does not fit into its type in the FMU"):
        drive(made(models.FEEDTHROUGH3, 3), rate="10 Hz", UInt8_in=[300, 0])
    with pytest.raises(RunError, match="beyond the whole numbers of a wire"):
        huge = Model("Huge", [Var("y", "UInt64", "output")], start="v_y = -1;", interfaces=("CoSimulation",))
        drive(made(huge, 3), rate="10 Hz", steps=1)


@BOTH
def test_outputs_follow_inputs_at_once_where_it_is_asked_for(version: int) -> None:
    model = models.FEEDTHROUGH2 if version == 2 else models.FEEDTHROUGH3
    held, direct = made(model, version), made(model, version, direct="always")
    assert "u" in direct.interface.feedthrough and not held.interface.feedthrough
    assert drive(held, rate="10 Hz", u=[1.0, 2.0, 3.0]).y.tolist() == [0.0, 1.0, 2.0]
    assert drive(direct, rate="10 Hz", u=[1.0, 2.0, 3.0]).y.tolist() == [1.0, 2.0, 3.0]


@EACH
def test_a_tunable_parameter_is_tuned_and_a_run_goes_back_to_a_snapshot(isolation: str) -> None:
    text = f"""
quadvis: 1
name: trial
rates: {{fast: 10 Hz}}
stop_time: 10 s
blocks:
  up: {{block: sources.ramp, rate: fast, with: {{slope: 1 1/s}}}}
  fmu:
    block: fmi.fmu
    rate: fast
    with: {{file: {fmu(models.FEEDTHROUGH2)}, isolation: {isolation}, gain: 2}}
    in: {{u: up.y}}
  sum:
    block: fmi.fmu
    rate: fast
    with: {{file: {fmu(models.INTEGRATOR)}, isolation: {isolation}}}
    in: {{u: fmu.y}}
"""
    with load_text(text, Path()).start() as run:
        run.advance("1 s")
        before = run.snapshot()
        run.advance("1 s")
        first = run["sum.x"]
        run["fmu.gain"] = 3.0
        run.advance("1 s")
        assert run["fmu.y"] == pytest.approx(3.0 * 2.8)
        run.restore(before)
        run["fmu.gain"] = 2.0
        run.advance("1 s")
        assert run["sum.x"] == first


def test_an_fmu_that_cannot_save_its_state_says_so() -> None:
    block = made(replace(models.INTEGRATOR, attributes=""))
    assert block.not_restorable == "the FMU cannot save its state"
    with load_text(
        f"""
quadvis: 1
name: trial
rates: {{fast: 10 Hz}}
stop_time: 10 s
blocks:
  sum: {{block: fmi.fmu, rate: fast, with: {{file: {block.file}}}, in: {{u: 1}}}}
""",
        Path(),
    ).start() as run:
        run.advance("1 s")
        before = run.snapshot()
        run.restore(before)  # nothing has changed since
        run.advance("1 s")
        with pytest.raises(
            RunError, match="block 'sum', t = 1 s: cannot go back: the FMU cannot save its state"
        ):
            run.restore(before)


def test_a_state_in_the_memory_of_the_fmu_serves_as_well() -> None:
    block = made(replace(models.INTEGRATOR, attributes='canGetAndSetFMU{s}="true"'), 2, "process")
    from fractions import Fraction

    from quadvis.testing.alone import alone

    with alone(block, {"u": 1.0}, {}, Fraction(1, 10)) as engine:
        engine.run(5)
        snapshot = engine.snapshot()
        engine.run(5)
        later = engine.read("block", "x")
        engine.restore(snapshot)
        engine.run(5)
        assert engine.read("block", "x") == later
        del snapshot


def test_an_fmu_has_a_process_of_its_own_also_where_a_thousand_files_are_open() -> None:
    import resource

    before = resource.getrlimit(resource.RLIMIT_NOFILE)
    if before[1] < 2000:
        pytest.skip("this user may not open so many files")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(2000, before[0]), before[1]))
    files = [os.dup(2) for _ in range(1024)]
    try:
        assert drive(made(models.INTEGRATOR, 2, "process"), rate="10 Hz", u=[1.0] * 3).x[-1] > 0.0
    finally:
        for each in files:
            os.close(each)
        resource.setrlimit(resource.RLIMIT_NOFILE, before)


def test_the_file_must_be_the_one_that_was_checked(tmp_path: Path) -> None:
    path = tmp_path / "x.fmu"
    path.write_bytes(Path(fmu(models.STAIR)).read_bytes())
    block = Fmu(file=str(path))
    path.write_bytes(Path(fmu(models.DAHLQUIST)).read_bytes())
    with pytest.raises(ParameterError, match="is not what it was when the diagram was loaded"):
        drive(block, rate="10 Hz", steps=2)


def test_a_step_inside_that_does_not_divide_the_period_is_a_doubt() -> None:
    model = replace(models.STAIR, attributes='canGetAndSetFMU{s}="true" fixedInternalStepSize="0.2"')
    (doubt,) = Fmu(file=fmu(model, 3), period=0.5).doubts()
    assert "the FMU steps by 0.2 s inside, which does not divide its period, 0.5 s" in str(doubt)
    assert Fmu(file=fmu(model, 3), period=0.4).doubts() == []


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_it_conforms_in_a_process_of_its_own(version: int) -> None:
    given = {"file": fmu(models.INTEGRATOR, version), "isolation": "process", "kind": "cosimulation"}
    check_block(Fmu, given=given, test=Path(__file__))


def test_its_code_is_announced_or_refused_and_never_reaches_a_target(tmp_path: Path) -> None:
    text = f"""\
quadvis: 1
name: trial
rates: {{fast: 10 Hz}}
stop_time: 1 s
blocks: {{fmu: {{block: fmi.fmu, rate: fast, with: {{file: {fmu(models.STAIR)}}}}}}}
"""
    (tmp_path / "trial.yaml").write_text(text)
    said: list[Path] = []
    load(tmp_path / "trial.yaml", own_blocks=said.append)
    assert said == [Path(fmu(models.STAIR))]
    words = "is machine code, which is not to be run; leave own_blocks=False out if you trust it"
    with pytest.raises(DiagramError, match=words):
        load(tmp_path / "trial.yaml", own_blocks=False)
    with pytest.raises(DiagramError, match=words):
        load_text(text, tmp_path, own_blocks=False)  # as a target does it with what comes from a host


def test_a_replay_runs_it_again_to_the_bit(tmp_path: Path) -> None:
    text = f"""\
quadvis: 1
name: trial
rates: {{fast: 10 Hz}}
stop_time: 2 s
blocks: {{fmu: {{block: fmi.fmu, rate: fast, with: {{file: {fmu(models.VAN_DER_POL)}, isolation: none}}}}}}
"""
    load_text(text, tmp_path).run(log=tmp_path / "run.mcap")
    assert quadvis.replay(tmp_path / "run.mcap").same
