"""What people see of parts that do not always run: pictures, descriptions, tables, warnings, refusals."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.cli import main
from quadvis.diagram.part_description import part_description
from quadvis.diagram.picture import draw_diagram

TEXT = """
quadvis: 1
name: test
params: {auto: true, first: 2 s^2}
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  time: {block: sources.clock, rate: fast}
  late: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: time.y, b: 0.5 s}}
  part:
    part: outer.yaml
    rate: fast
    when: {from: late.y, states: reset, outputs: reset}
    initial: {y: $first}
    in: {u: time.y, auto: $auto}
  twice: {block: signal.gain, rate: fast, with: {factor: 2}, in: {u: part.y}}
"""
OUTER = """
quadvis: 1
name: outer
ports: {in: [u, auto], out: {y: inner.y}}
blocks:
  large: {block: logic.compare, with: {operator: ">"}, in: {a: in.u, b: 0.7 s}}
  inner: {part: inner.yaml, when: in.auto, triggered: either large.y, reset: falling large.y, in: {u: in.u}}
"""
INNER = """
quadvis: 1
name: inner
ports: {in: [u], out: {y: sum.y}}
blocks:
  sum: {block: signal.discrete_integrator, in: {u: in.u}}
"""


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("test", TEXT), ("outer", OUTER), ("inner", INNER)):
        Path(f"{name}.yaml").write_text(text)


def test_a_picture_has_the_condition_in_the_part_and_wires_past_its_outputs() -> None:
    picture = draw_diagram(load_text(TEXT))
    assert "logic.part_output" not in picture
    for words in (
        "part/inner/sum.y → twice.u",
        "late.y → part/when.when",
        "part/large.y → part/inner/when.trigger",
        "when: late.y",
        "initial outputs while disabled",
        "runs at either edges",
    ):
        assert words in picture, words


def test_the_box_of_a_part_says_when_it_runs() -> None:
    picture = draw_diagram(load_text(TEXT), depth=1)
    for words in ("when: late.y", "states set back when enabled", "part.y → twice.u"):
        assert words in picture, words
    assert "part/large.y" not in picture


def test_the_description_of_a_part_says_when_parts_in_it_run() -> None:
    words = "inner  inner.yaml, when in.auto, triggered either large.y, reset falling large.y"
    assert words in part_description("outer.yaml")


def test_the_table_of_a_program_says_what_depends_on_what(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["program", "test.yaml"]) == 0
    lines = [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]
    assert any("update" in line and "part/inner/sum" in line and "while part/inner/when.active" in line
               for line in lines)  # fmt: skip
    assert any(line.startswith("reset") and "part/inner/sum.integral" in line for line in lines)


def test_parameters_of_conditions_are_used_and_cannot_be_tuned() -> None:
    diagram = load_text(TEXT.replace("when: {from: late.y,", "when: {from: late.y, across: sample,"))
    assert not diagram.warnings
    assert diagram.knobs["first"].elsewhere == ("a condition of 'part'",)


def test_the_schema_knows_the_keys(capsys: pytest.CaptureFixture[str]) -> None:
    jsonschema = pytest.importorskip("jsonschema")
    assert main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    block = {"$ref": "#/$defs/block", "$defs": schema["$defs"]}
    right = [
        {"when": "a.y"},
        {"when": "$auto"},
        {"when": {"from": "a.y", "across": "hold", "states": "reset", "outputs": "held"}},
        {"triggered": "rising a.y", "initial": {"y": "2 m"}},
        {"triggered": {"from": "a.y", "edge": "either"}, "reset": "b/c.y"},
    ]
    wrong = [
        {"when": {"states": "reset"}},
        {"triggered": "at a.y"},
        {"reset": {"from": "a.y", "states": "held"}},
        {"when": {"from": "a.y", "states": "frozen"}},
    ]
    for entries, fits in ((right, True), (wrong, False)):
        for entry in entries:
            found = jsonschema.Draft202012Validator(block).is_valid({"part": "a.yaml", **entry})
            assert found == fits, entry
