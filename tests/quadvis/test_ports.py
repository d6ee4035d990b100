"""A block whose ports come from a file: its class has them as soon as the parameter is known."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadvis.api import load, load_text
from quadvis.block import Block, In, Out, Param, ParameterError
from quadvis.errors import DiagramError
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import description, facts
from quadvis.testing import check_block, drive

MIXER = '''"""A matrix from a file."""

import json

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError


class Matrix(Block, numeric=False):
    """Weighted sums of its inputs: each output has a row of weights, by the names of the inputs."""

    file = Param(type="file", doc="JSON file: inputs, and for each output its weights")
    gain = Param(1.0, doc="of all outputs")

    @classmethod
    def ports(cls, file):
        with open(file) as text:
            read = json.load(text)
        if not read["outputs"]:
            raise ParameterError("file", "file must name an output")
        inputs = {name: In(unit=unit, doc="term") for name, unit in read["inputs"].items()}
        return inputs | {name: Out(unit="m", doc="sum") for name in read["outputs"]}

    def open(self):
        with open(self.file) as text:
            self._rows = [list(row.values()) for row in json.load(text)["outputs"].values()]

    def output(self, *inputs):
        sums = tuple(self.gain * float(np.dot(row, inputs)) for row in self._rows)
        return sums if len(sums) > 1 else sums[0]
'''
MODEL = {"inputs": {"a": "m", "b": "m"}, "outputs": {"s": {"a": 1.0, "b": 2.0}, "d": {"a": 1.0, "b": -1.0}}}
DIAGRAM = """quadvis: 1
name: sums
rates: {fast: 10 Hz}
stop_time: 0.3 s
blocks:
  one: {block: sources.ramp, rate: fast, with: {slope: 1 m/s}}
  matrix: {block: matrix, rate: fast, with: {file: model.json}, in: {a: one.y, b: 2 m}}
  gain: {block: signal.gain, rate: fast, with: {factor: 2}, in: {u: matrix.s}}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "blocks").mkdir()
    (tmp_path / "blocks" / "matrix.py").write_text(MIXER)
    (tmp_path / "model.json").write_text(json.dumps(MODEL))
    (tmp_path / "sums.yaml").write_text(DIAGRAM)
    return tmp_path


def problems(folder: Path, before: str, after: str) -> list[str]:
    """Return what is wrong with the diagram after an edit."""
    assert DIAGRAM.count(before) == 1
    with pytest.raises(DiagramError) as caught:
        load_text(DIAGRAM.replace(before, after), folder)
    return [f"{fault.place.line}: {fault.subject}: {fault}" for fault in caught.value.faults]


def test_a_diagram_wires_the_ports_that_the_file_names(folder: Path) -> None:
    result = load(folder / "sums.yaml").run()
    assert result["matrix.s"] == pytest.approx([4.0, 4.1, 4.2, 4.3])
    assert result["gain.y"] == pytest.approx([8.0, 8.2, 8.4, 8.6])
    assert result.units["gain.y"] == "m"


def test_two_files_make_two_kinds_of_one_block(folder: Path) -> None:
    kind = Catalogue(folder).find("matrix")
    other = {"inputs": {"x": "1"}, "outputs": {"y": {"x": 3.0}}}
    (folder / "other.json").write_text(json.dumps(other))
    first, second = kind(file=str(folder / "model.json")), kind(file=str(folder / "other.json"))
    assert list(first.interface.inputs) == ["a", "b"] and list(second.interface.outputs) == ["y"]
    assert first.interface.feedthrough == {"a", "b"} and kind.interface.inputs == {}
    assert isinstance(first, kind) and type(first).__name__ == "Matrix"
    assert drive(second, x=[1.0, 2.0]).y.tolist() == [3.0, 6.0]


@pytest.mark.parametrize(
    ("before", "after", "problem"),
    [
        ("b: 2 m", "c: 2 m", "matrix has no input 'c'"),
        ("matrix.s", "matrix.t", "no output 't'"),
        ("model.json", "none.json", "none.json"),
        (", with: {file: model.json}", "", "parameter 'file' is missing; give a path"),
    ],
)
def test_what_does_not_go_with_the_file_is_a_fault(
    before: str, after: str, problem: str, folder: Path
) -> None:
    found = problems(folder, before, after)
    assert any(problem in line for line in found), found


def test_a_file_that_names_no_ports_is_refused_at_its_place_and_once(folder: Path) -> None:
    (folder / "model.json").write_text(json.dumps({"inputs": {}, "outputs": {}}))
    with pytest.raises(DiagramError) as caught:
        load(folder / "sums.yaml")
    (fault,) = caught.value.faults
    assert (fault.place.line, fault.place.column) == (7, DIAGRAM.splitlines()[6].index("model.json") + 1)
    assert "file must name an output" in str(fault)


def test_it_conforms(folder: Path) -> None:
    kind = Catalogue(folder).find("matrix")
    given = {"file": str(folder / "model.json")}
    check_block(kind, given=given, test=folder / "blocks" / "matrix.py")


def test_describe_says_on_what_the_ports_depend(folder: Path) -> None:
    kind = Catalogue(folder).find("matrix")
    assert "\nports: they depend on file\n" in description("matrix", kind)
    assert facts("matrix", kind)["tags"]["ports"] == "they depend on file"


def test_ports_ask_for_parameters_that_there_are() -> None:
    class Fixed(Block):
        """A block like any other."""

        u = In(doc="u")
        y = Out(doc="y")
        gain = Param(1.0, doc="gain")

        def output(self, u):
            return self.gain * u

    assert Fixed.with_ports({"gain": 2.0}) is Fixed and Fixed.ports_from() == ()
    with pytest.raises(TypeError, match="ports asks for 'size', which is not one of its parameters"):
        type("Wrong", (Block,), {"ports": classmethod(lambda cls, size: {}), "gain": Param(1.0)})
    with pytest.raises(TypeError, match="output asks for 'inputs', which is not one of its inputs"):
        type("Wrong", (Block,), {"y": Out(), "output": lambda self, *inputs: 0.0})
    with pytest.raises(ParameterError, match="parameter 'gain' is missing"):
        type("Right", (Block,), {"ports": classmethod(lambda cls, gain: {}), "gain": Param()}).with_ports({})
