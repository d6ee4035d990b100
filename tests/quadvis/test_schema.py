"""quadvis.schema"""

from functools import cache
from pathlib import Path

import pytest
import yaml
from jsonschema import Draft202012Validator

from quadvis.catalogue import Catalogue
from quadvis.schema import diagram_schema

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
FILES = sorted([*DIAGRAMS.glob("*.yaml"), *DIAGRAMS.glob("parts/*.yaml")])
HOVER = (DIAGRAMS / "hover.yaml").read_text()


@cache
def validator():
    schema = diagram_schema(Catalogue())
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.name)
def test_every_diagram_and_part_is_valid(file):
    assert [error.message for error in validator().iter_errors(yaml.safe_load(file.read_text()))] == []


def test_every_block_is_offered_with_its_sentence():
    offered = {entry["const"]: entry["description"] for entry in
               validator().schema["$defs"]["block"]["properties"]["block"]["anyOf"] if "const" in entry}  # fmt: skip
    assert set(offered) == set(Catalogue().names())
    assert offered["control.nested_saturation"].endswith("privileging small angles.")


@pytest.mark.parametrize(
    ("right", "wrong"),
    [
        ("quadvis: 1", "quadvis: 2"),
        ("name: hover", "nmae: hover"),
        ("stop_time: 140 s", "stop_time: [140]"),
        ("block: plant.gust", "block: plant.gusts"),
        ("across: hold", "across: latch"),
        ("with: {target: $target}", "with: {targets: $target}"),
        ("in: {centres: eyes.centres}", "in: {centre: eyes.centres}"),
        ("in: {centres: eyes.centres}", "in: {centres: eyes}"),
        ("method: ode4", "method: ode45"),
        ("    slot: true", "    slot: maybe"),
        ("    part: parts/estimate.yaml", "    part: parts/estimate.yaml\n    block: plant.gust"),
        ("count: 0", "counts: 0"),
    ],
)
def test_a_defect_is_refused(right, wrong):
    assert right in HOVER
    assert not validator().is_valid(yaml.safe_load(HOVER.replace(right, wrong, 1)))


def test_parameters_carry_their_words_and_defaults():
    bandwidth = validator().schema["$defs"]["block:control.nested_saturation"]["properties"]["with"]["properties"][
        "bandwidth"
    ]
    assert bandwidth["default"] == "2 rad/s"
    assert "poles" in bandwidth["description"]
