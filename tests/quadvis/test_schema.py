"""The JSON schema, judged by jsonschema: it takes every right diagram and refuses what is wrong in form."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from quadvis.api import load
from quadvis.diagram.schema import diagram_schema
from quadvis.library.catalogue import Catalogue

from .corpus import all_cases

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
SCHEMA = diagram_schema(Catalogue().load_all()[0])
VALIDATOR = Draft202012Validator(SCHEMA)


def faults(data: Any) -> list[str]:
    return [error.message for error in VALIDATOR.iter_errors(data)]


def read(text: str) -> Any:
    return yaml.safe_load(text)


def test_the_schema_is_one() -> None:
    Draft202012Validator.check_schema(SCHEMA)


FILES = sorted([*DIAGRAMS.glob("*.yaml"), *DIAGRAMS.glob("parts/*.yaml")])


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_every_diagram_and_part_of_the_repository_is_valid(path: Path) -> None:
    assert faults(read(path.read_text(encoding="utf-8"))) == []


def test_a_resolved_diagram_is_valid() -> None:
    assert faults(read(load(DIAGRAMS / "hover.yaml").resolved)) == []


RIGHT = [case for case in all_cases() if not case.expected()]


@pytest.mark.parametrize("case", RIGHT, ids=lambda case: case.title)
def test_what_the_checker_takes_the_schema_takes(case: Any) -> None:
    data = read("\n".join(case.files["case.yaml"]))
    data.setdefault("stop_time", "1 s")
    assert faults(data) == []


BASE = """\
quadvis: 1
name: case
rates: {fast: 100 Hz}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: 1 m}}
  slope: {block: signal.derivative, rate: fast, in: {u: wave.y}}
"""


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("quadvis: 1", "quadvis: 2"),
        ("quadvis: 1\n", ""),
        ("name: case\n", ""),
        ("name: case", "name: [case]"),
        ("rates", "rtes"),
        ("stop_time", "stoptime"),
        ("blocks:", "blocks: {}\nblock:"),
        ("block: sources.sine", "block: sources.sin"),
        ("block: sources.sine", "blok: sources.sine"),
        ("block: sources.sine", "block: sources.sine, part: x.yaml"),
        ("amplitude", "amplitud"),
        ("with: {amplitude: 1 m}", "with: [1]"),
        ("in: {u: wave.y}", "in: {v: wave.y}"),
        ("in: {u: wave.y}", "in: {stamp: wave.y}"),
        ("in: {u: wave.y}", "in: {u: wave}"),
        ("in: {u: wave.y}", "in: {u: {from: wave.y, across: smaple}}"),
        ("in: {u: wave.y}", "in: {u: {form: wave.y}}"),
        ("in: {u: wave.y}", "in: [wave.y]"),
        ("rate: fast, in", "rat: fast, in"),
        ("stop_time: 1 s", "stop_time: 1 s\nsolver: {method: ode5}"),
        ("stop_time: 1 s", "stop_time: 1 s\nseed: 1.5"),
        ("stop_time: 1 s", "stop_time: 1 s\nports: {in: [u]}"),
        ("stop_time: 1 s", "stop_time: 1 s\nlog: {every: {fast: 0}}"),
        ("stop_time: 1 s", "stop_time: 1 s\nexpect: [{within: 1 m}]"),
        ("stop_time: 1 s", "stop_time: 1 s\nexpect: [{signal: wave.y, wthin: 1 m}]"),
        ("stop_time: 1 s", "stop_time: 1 s\nsummary: {x: {signal: wave.y, show: [rsm]}}"),
        ("stop_time: 1 s", "stop_time: 1 s\nfigures: [{title: x, signals: wave.y, panels: []}]"),
        ("stop_time: 1 s", "stop_time: 1 s\nfigures: [{title: x, panels: [{signal: wave.y}]}]"),
        ("stop_time: 1 s", "stop_time: 1 s\nvariants: {a: {slot: {}}}"),
        ("stop_time: 1 s", "stop_time: 1 s\nparams: {x: {value: 1, units: m}}"),
        ("{fast: 100 Hz}", "{fast: {rate: 100 Hz, ofset: 1 s}}"),
        ("signal.derivative, rate", "vision.pose_plane, rate"),
    ],
)
def test_what_is_wrong_in_form_is_refused(old: str, new: str) -> None:
    assert faults(read(BASE)) == []
    assert old in BASE
    assert faults(read(BASE.replace(old, new, 1))) != []


@pytest.mark.parametrize(
    "block",
    [
        "{block: sources.sine, rate: fast, with: {amplitude: $size, bias: '$size[2]'}}",
        "{block: sources.constant, rate: fast, with: {value: {value: [1, 2], unit: m}}}",
        "{block: sources.constant, rate: fast, with: {value: [[1 m, 2 m], [3, 4.5]]}}",
        "{block: signal.derivative, rate: fast, in: {u: 3 m, valid: true, stamp: {value: 1, unit: s}}}",
        "{block: signal.derivative, rate: fast, in: {u: 'in.u[0:2]', valid: $ok}}",
        "{block: 'acme:slope', rate: fast, with: {anything: 3}, in: {whatever: wave.y}}",
        "{part: parts/x.yaml, slot: true, with: {any: 1}, in: {u: {from: wave.y, across: hold}}}",
    ],
)
def test_every_form_of_a_value_is_taken(block: str) -> None:
    assert faults(read(f"{BASE}  more: {block}\n")) == []


@pytest.mark.parametrize("default", ["2 m", "true", "[1, 2]", "{value: [1, 2], unit: m}", "-1"])
def test_an_input_of_a_part_may_have_a_constant_as_its_default(default: str) -> None:
    part = "quadvis: 1\nname: part\nports: {in: [u, {size: %s}]}\nblocks: {}\n"
    assert faults(read(part % default)) == []
    assert faults(read(part % "wave.y")) != [] != faults(read(part % "{from: wave.y}"))


def test_editors_can_show_what_blocks_ports_and_parameters_are() -> None:
    derivative = SCHEMA["$defs"]["block:signal.derivative"]
    assert "backward difference" in derivative["description"]
    gap = derivative["properties"]["with"]["properties"]["gap_reset"]
    assert gap["default"] == "0.4 s"
    assert gap["description"] == "longest gap (inclusive) that a difference may span (float64, s)"
    names = {entry.get("const") for entry in SCHEMA["$defs"]["block"]["properties"]["block"]["anyOf"]}
    assert names >= set(Catalogue().names())


def test_no_name_is_a_truth_value_for_readers_of_yaml_1_1() -> None:
    """An editor, or another program, would read a key `on` as true."""
    catalogue = Catalogue()
    for name in catalogue.names():
        interface = catalogue.find(name).interface
        for item in (*interface.params, *interface.inputs):
            assert yaml.safe_load(item) == item, f"{name}: {item}"
