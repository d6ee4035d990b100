"""Parameters and times that are computed, and matrices of files, in diagrams that run and sweep."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from jsonschema import Draft202012Validator

import quadvis
from quadvis.diagram.computed import is_computed
from quadvis.diagram.schema import diagram_schema
from quadvis.document import parse_yaml
from quadvis.errors import DiagramError, QuadvisError
from quadvis.graph.graph import Tolerances
from quadvis.library.catalogue import Catalogue

DIAGRAM = """\
quadvis: 1
name: computed
params:
  fs: 100 Hz
  ts: 1/$fs
  T: 2 s
  mass: 30 g
  weight: $mass * 9.80665 m/s^2
  gains: {file: gains.npz, name: K}
  craft: {group: craft.yaml}
rates: {control: $fs, slow: {rate: $fs/10, offset: 2*$ts}}
solver: {method: ode4, step: $ts / 2}
stop_time: $T / 2
blocks:
  wave: {block: sources.sine, rate: control, with: {frequency: $fs/20, amplitude: -$weight, phase: pi/2 rad}}
  hold: {block: sources.constant, rate: slow, with: {value: $craft.double}}
  state: {block: sources.constant, rate: control, with: {value: [1, 2]}}
  law: {block: math.matrix_gain, rate: control, with: {gain: -$gains}, in: {u: state.y}}
  count: {block: signal.delay, rate: control, with: {steps: 2 * 3}, in: {u: wave.y}}
  inner: {part: part.yaml, rate: control, with: {size: $T * 3 m/s}}
  sum: {block: signal.integrator, in: {u: {from: wave.y, across: hold}}}
"""
PART = """\
quadvis: 1
name: part
ports: {out: {y: value.y}}
params: {size: 1 m, area: $size^2}
blocks:
  value: {block: sources.constant, with: {value: $area}}
"""
CRAFT = "quadvis: 1\nname: craft\nparams: {double: 2 * $single, single: 3 m}\n"
K = np.array([[0.1, 1 / 3], [2.0, -1e-9]])


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "computed.yaml"
    path.write_text(DIAGRAM)
    (tmp_path / "part.yaml").write_text(PART)
    (tmp_path / "craft.yaml").write_text(CRAFT)
    np.savez(tmp_path / "gains.npz", K=K)
    return path


def test_values_are_computed(path: Path) -> None:
    diagram = quadvis.load(path)
    values = {node.path: node.block for node in diagram.graph.nodes}
    assert values["wave"].amplitude == -0.2941995  # exact, then rounded once
    assert values["wave"].frequency == 5.0
    assert values["hold"].value == 6.0
    assert np.array_equal(values["law"].gain, -K)
    assert values["count"].steps == 6
    assert values["inner/value"].value == 36.0
    assert not diagram.warnings


def test_times_are_computed_exactly(path: Path) -> None:
    diagram = quadvis.load(path)
    tasks = {task.name: task for task in diagram.graph.tasks}
    assert tasks["control"].period == Fraction(1, 100)
    assert (tasks["slow"].period, tasks["slow"].offset) == (Fraction(1, 10), Fraction(1, 50))
    assert diagram.graph.step == Fraction(1, 200)
    assert diagram.stop_time == 1


def test_settings_go_through_what_is_computed(path: Path) -> None:
    diagram = quadvis.load(path, settings={"fs": "50 Hz", "mass": "2*30 g", "craft.single": "1 m"})
    tasks = {task.name: task for task in diagram.graph.tasks}
    assert tasks["control"].period == Fraction(1, 50)
    assert diagram.graph.step == Fraction(1, 100)
    assert diagram.graph["wave"].block.amplitude == -0.588399
    assert diagram.graph["hold"].block.value == 2.0


def test_times_are_settings(path: Path) -> None:
    settings = {"rates.control": "200 Hz", "solver.step": "1 ms", "stop_time": "3 s"}
    diagram = quadvis.load(path, settings=settings)
    assert diagram.graph["wave"].task.period == Fraction(1, 200)
    assert diagram.graph.step == Fraction(1, 1000)
    assert diagram.stop_time == 3
    assert quadvis.load(path, settings=settings, stop_time="4 s").stop_time == 4


@pytest.mark.parametrize("method", ["Radau", "radau", "RADAU"])
def test_the_method_of_the_solver_and_its_tolerances_are_settings(path: Path, method: str) -> None:
    diagram = quadvis.load(path, settings={"solver.method": method, "solver.rtol": 1e-9})
    assert diagram.graph.solver == "Radau"
    assert diagram.graph.tolerances == Tolerances(1e-9, 1e-9)
    again = quadvis.load(path, settings={"solver.method": "ode3"})
    assert (again.graph.solver, again.graph.step) == ("ode3", diagram.graph.step)


def test_a_method_of_fixed_step_leaves_tolerances_of_the_file_alone(path: Path) -> None:
    path.write_text(DIAGRAM.replace("method: ode4", "method: BDF, rtol: 1e-8"))
    assert quadvis.load(path).graph.tolerances.rtol == 1e-8
    fixed = quadvis.load(path, settings={"solver.method": "ode2"})
    assert fixed.graph.solver == "ode2" and not fixed.warnings
    assert quadvis.load(path, settings={"solver.atol": "1e-4"}).graph.tolerances == Tolerances(1e-8, 1e-4)


@pytest.mark.slow
def test_a_sweep_goes_over_methods_and_steps(path: Path) -> None:
    over = {"solver.method": ["ode1", "ode4", "RK45"], "solver.step": ["5 ms", "10 ms"]}
    lag = "block: systems.transfer_function, with: {numerator: [1], denominator: [0.1, 1]}"
    text = f"  lag: {{{lag}, in: {{u: {{from: wave.y, across: hold}}}}}}\n"
    path.write_text(f"{DIAGRAM}{text}summary: {{lag: {{signal: lag.y, show: [final]}}}}\n")
    table = quadvis.sweep(path, over=over, workers=1)
    found = [float(value) for value in next(each for name, each in table.items() if name.startswith("lag"))]
    assert len(found) == 6
    exact = found[-1]
    assert found[2:] == pytest.approx([exact] * 4, rel=1e-4)
    assert all(abs(value / exact - 1) > 1e-3 for value in found[:2])


def test_a_block_with_the_name_of_times_keeps_its_settings(path: Path) -> None:
    text = DIAGRAM + "  solver: {block: sources.step, rate: control, with: {at: 1 s}}\n"
    path.write_text(text)
    diagram = quadvis.load(path, settings={"solver.at": "0.5 s"})
    assert diagram.graph["solver"].block.at == 0.5


def test_the_resolved_diagram_is_the_same(path: Path) -> None:
    diagram = quadvis.load(path)
    other = path.with_name("other.yaml")
    other.write_text(diagram.resolved)
    again = quadvis.load(other)
    assert again.hash == diagram.hash
    assert "$" not in diagram.resolved


def test_a_sweep_changes_a_rate(path: Path) -> None:
    table = quadvis.sweep(path, over={"fs": ["50 Hz", "100 Hz"]}, workers=1)
    assert len(table["fs [Hz]"] if "fs [Hz]" in table else table["fs"]) == 2


def test_a_file_of_a_matrix_is_an_input(path: Path) -> None:
    diagram = quadvis.load(path)
    assert path.with_name("gains.npz") in diagram.inputs
    assert str(path.with_name("gains.npz")) in diagram.files


def test_a_row_is_a_vector_where_one_is_wanted(path: Path) -> None:
    path.with_name("row.csv").write_text("-1,0,1\n")
    entry = "with: {breakpoints: {file: row.csv, unit: m}, values: {file: row.csv}}, in: {u: 0.5 m}"
    path.write_text(DIAGRAM + f"  table: {{block: signal.lookup_1d, rate: slow, {entry}}}\n")
    assert quadvis.load(path).graph["table"].block.breakpoints.tolist() == [-1, 0, 1]


def test_what_is_computed_cannot_be_tuned(path: Path) -> None:
    knobs = quadvis.load(path).knobs
    assert not knobs["mass"].targets
    assert "a rate, the step or the stop time" in knobs["ts"].elsewhere
    assert "a rate, the step or the stop time" in knobs["T"].elsewhere


def test_the_schema_takes_arithmetic(path: Path) -> None:
    Draft202012Validator(diagram_schema(Catalogue().load_all()[0])).validate(
        parse_yaml(DIAGRAM, "x").to_python()
    )


@pytest.mark.parametrize("text", ["%d $GP", "cost 5 $", "data/$x.csv", "a$b", "$", "$GPGGA,*", "[$a]"])
def test_texts_that_do_not_begin_as_arithmetic_are_texts(text: str) -> None:
    assert not is_computed(text) or text == "$GPGGA,*"


def test_a_setting_names_no_parameters(path: Path) -> None:
    with pytest.raises(QuadvisError, match=r"'mass': '\$T' stands where a value must"):
        quadvis.load(path, settings={"mass": "$T"})
    with pytest.raises(DiagramError, match=r"'\$T' stands where a value must"):
        quadvis.load(path, settings={"mass": "2 * $T"})
