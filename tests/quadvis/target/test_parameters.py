import math
from pathlib import Path

import pytest

import quadvis
from quadvis.diagram.diagram import Diagram
from quadvis.errors import QuadvisError
from quadvis.run.tuned import new_values
from quadvis.target.parameters import Parameters, as_written, read_set

LOOP = """\
quadvis: 1
name: loop
rates: {fast: 100 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
blocks:
  push: {block: sources.constant, rate: fast, with: {value: 1 N}}
  sum: {block: signal.integrator, rate: continuous, in: {u: {from: push.y, across: hold}}}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "loop.yaml"
    path.write_text(LOOP)
    return path


def given_again(diagram: Diagram, parameters: Parameters, path: Path) -> None:
    """Let parameters have the values of a set, as a target does it."""
    values = {name: as_written(value) for name, value in read_set(path).items()}
    group = new_values(diagram, values)
    parameters.check(group)
    parameters.took(group)


def test_a_set_with_infinite_limits_can_be_loaded(path: Path, tmp_path: Path) -> None:
    diagram = quadvis.load(path)
    parameters = Parameters(diagram)
    parameters.save(tmp_path / "set.yaml")
    assert read_set(tmp_path / "set.yaml")["sum.upper"] == "inf N*s"
    parameters.took(new_values(diagram, {"sum.upper": "5 N*s", "sum.lower": "-2 N*s"}))
    given_again(diagram, parameters, tmp_path / "set.yaml")
    assert parameters.value("sum", "upper") == math.inf
    assert parameters.value("sum", "lower") == -math.inf
    assert quadvis.load(path, params=tmp_path / "set.yaml").hash == diagram.hash


def test_what_is_infinite_by_default_may_be_written_so(path: Path) -> None:
    assert quadvis.load(path, settings={"sum.upper": "inf", "sum.lower": "-inf N*s"}).hash
    for text, problem in (
        ("-inf", "'-inf' does not begin with a number"),
        ("inf m", "'upper' has m, its unit here is N\\*s"),
        ("inf foo", "'foo' is not a unit"),
    ):
        with pytest.raises(QuadvisError, match=problem):
            quadvis.load(path, settings={"sum.upper": text})
    with pytest.raises(QuadvisError, match="'inf N' does not begin with a number"):
        quadvis.load(path, settings={"push.value": "inf N"})


def test_a_parameter_of_the_diagram_has_the_value_of_the_blocks_that_have_it(path: Path) -> None:
    path.write_text(
        LOOP.replace("blocks:", "params: {push: 1 N}\nblocks:").replace("value: 1 N", "value: $push")
    )
    parameters = Parameters(quadvis.load(path))
    assert parameters.text(*parameters.find("push")) == "1.0 N"
    parameters.took(new_values(quadvis.load(path), {"push": "2 N"}))
    assert parameters.text(*parameters.find("push")) == "2.0 N"
    with pytest.raises(QuadvisError, match="there is no parameter 'pusch'; did you mean 'push'"):
        parameters.find("pusch")
