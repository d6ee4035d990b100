"""Exported parts and blocks that do not always run: they do to the bit what the interpreter does."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.api import load_text
from quadvis.cli import main
from quadvis.errors import QuadvisError
from tests.fmus.builder import needs_gcc
from tests.quadvis.test_conditions import EVERYTHING, HEAD, PARTS, ROWS, SIGNALS, of, table

pytestmark = needs_gcc
DRAWN = """
  drawn:
    block: sources.noise
    rate: fast
    when: {from: on.y, outputs: reset}
    reset: off.y
    with: {sigma: 1 m}
    initial: {y: 4 m}
  path_: {block: signal.integrator, when: {from: on.y, across: hold}, reset: {from: off.y, across: hold},
      with: {initial: 1 s}, in: {u: {from: one.y, across: hold}}}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in PARTS.items():
        Path(name).write_text(text)


def simulated(path: str, step: float) -> Any:
    from fmpy import simulate_fmu

    return simulate_fmu(path, stop_time=2.0, step_size=step, output_interval=step)


@pytest.mark.slow
@pytest.mark.parametrize("version", [2, 3])
def test_a_whole_diagram_with_all_kinds_of_conditions(version: int) -> None:
    diagram = load_text(HEAD + EVERYTHING + DRAWN)
    diagram.export_fmu(".", "all.fmu", version=version)
    found, ours = simulated("all.fmu", 0.05), diagram.run(engine="python")
    for name in (*SIGNALS, "drawn.y", "path_.y"):
        wanted = of(ours, name)
        text = diagram.ports.get(name, name)
        every = (len(found) - 1) // (len(wanted) - 1)
        assert np.array_equal(found[text.replace("/", ".")][::every], wanted), name
    assert len(set(of(ours, "drawn.y").tolist())) > 5


CLOSED = (
    HEAD
    + table("on", ROWS)
    + table("off", "000001100000010001000")
    + """
  late: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: time.y, b: 0.5 s}}
  NAME: {KIND, in: {INPUTS}}
  twice: {block: signal.gain, rate: fast, with: {factor: 2}, in: {u: NAME.y}}
"""
)
KINDS = {
    "part": ("part: nest.yaml, rate: fast, reset: off.y, when: {from: on.y, states: reset, outputs: reset}, "
             "initial: {y: -1 s}", "u: one.y, inner: late.y"),
    "block": ("block: signal.discrete_integrator, rate: fast, reset: off.y, "
              "when: {from: on.y, outputs: reset}, with: {initial: 5 s}, initial: {y: 3 s}", "u: one.y"),
    "trigger": ("block: signal.gain, rate: fast, triggered: either off.y, when: on.y, with: {factor: 3}",
                "u: time.y"),
}  # fmt: skip


@pytest.mark.parametrize(
    "kind", [pytest.param(kind, marks=[pytest.mark.slow] if kind != "block" else []) for kind in KINDS]
)
def test_its_condition_is_an_input_and_it_closes_the_loop_to_the_bit(kind: str) -> None:
    entry, inputs = KINDS[kind]
    text = CLOSED.replace("NAME", "law").replace("KIND", entry).replace("INPUTS", inputs)
    diagram = load_text(text)
    made = diagram.export_fmu("law", "law.fmu")
    read = [name for name in ("when", "trigger", "reset") if name in made.inputs]
    assert read == {"trigger": ["when", "trigger"]}.get(kind, ["when", "reset"])
    wires = ", ".join([inputs, *(f"{name}: {'on' if name == 'when' else 'off'}.y" for name in read)])
    fmu = "block: fmi.fmu, rate: fast, with: {file: law.fmu, isolation: none}"
    other = load_text(CLOSED.replace("NAME", "law").replace("KIND", fmu).replace("INPUTS", wires))
    one, two = diagram.run(engine="python"), other.run(engine="python")
    for name in ("law.y", "twice.y"):
        assert np.array_equal(of(one, name), of(two, name)), name
    assert len(set(of(one, "law.y").tolist())) > 3


def test_inputs_that_are_set_once_more_at_one_tick_leave_no_trace() -> None:
    """An importer tries inputs, reads outputs, and sets others before the step."""
    from fmpy import extract, read_model_description
    from fmpy.fmi2 import FMU2Slave

    entry, inputs = KINDS["block"]
    entry = entry.replace(", outputs: reset", ", states: reset")
    text = CLOSED.replace("NAME", "law").replace("KIND", entry).replace("INPUTS", inputs)
    diagram = load_text(text)
    diagram.export_fmu("law", "law.fmu")
    ours = diagram.run(engine="python")
    description = read_model_description("law.fmu")
    at = {each.name: each.valueReference for each in description.modelVariables}
    slave = FMU2Slave(
        guid=description.guid, unzipDirectory=extract("law.fmu", str(Path.cwd() / "law")),
        modelIdentifier=description.coSimulation.modelIdentifier, instanceName="law",
    )  # fmt: skip
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    slave.exitInitializationMode()
    slave.setReal([at["u"]], [1.0])
    found, tried = [], []
    for k in range(20):
        on, off = bool(of(ours, "on.y")[k]), bool(of(ours, "off.y")[k])
        for when, reset in ((True, True), (not on, not off), (True, False), (on, off)):
            slave.setBoolean([at["when"], at["reset"]], [when, reset])
            tried += slave.getReal([at["y"]])
        found.append(tried[-1])
        slave.doStep(0.1 * k, 0.1)
    slave.terminate()
    slave.freeInstance()
    assert found == of(ours, "law.y")[:20].tolist()
    assert tried != np.repeat(found, 4).tolist()


def test_a_block_whose_condition_is_outside_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    entry, inputs = KINDS["part"]
    text = CLOSED.replace("NAME", "law").replace("KIND", entry).replace("INPUTS", inputs)
    Path("loop.yaml").write_text(text)
    assert main(["export", "loop.yaml", "--fmu", "law/own", "-o", "own.fmu"]) == 2
    words = "'law/own' does not always run: its condition 'law/when' lies outside of it; export 'law'"
    assert words in capsys.readouterr().err
    with pytest.raises(QuadvisError, match="lies outside"):
        quadvis.load("loop.yaml").export_fmu("law/inner", "inner.fmu")
