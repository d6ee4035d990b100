"""Groups of parameters: stated once, taken by many blocks. Their faults are in `cases/groups.yaml`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

import quadvis
from quadvis.diagram.load import check
from quadvis.diagram.schema import diagram_schema
from quadvis.library.catalogue import Catalogue

DIAGRAM = """\
quadvis: 1
name: craft
rates: {fast: 100 Hz}
solver: {method: ode4, step: 10 ms}
stop_time: 1 s
params:
  vehicle: {group: crafts/large.yaml}
blocks:
  body:
    block: plant.rotorcraft
    group: $vehicle
    with: {arm: 0.5 m}
    in: {thrust: {from: mixer.thrust, across: hold}}
  mixer:
    slot: true
    block: control.mixer
    rate: fast
    group: $vehicle
    in: {collective: 5 N, roll: 0, pitch: 0, yaw: 0}
  first: {block: signal.gain, rate: fast, with: {factor: "$vehicle.inertia[1]"}, in: {u: 1}}
  inner: {part: inner.yaml, rate: fast, group: $vehicle, with: {vehicle: $vehicle}}
  other: {part: inner.yaml, rate: fast}
variants:
  plain: {slots: {mixer: {block: control.mixer}}}
"""
FILES = {
    "craft.yaml": DIAGRAM,
    "inner.yaml": """\
quadvis: 1
name: inner
params: {vehicle: {group: crafts/small.yaml}, mass: 7 kg}
ports: {}
blocks:
  body:
    block: plant.rotorcraft
    group: $vehicle
    with: {mass: $mass}
    in: {thrust: {value: [1, 1, 1, 1], unit: N}}
""",
    "crafts/large.yaml": """\
quadvis: 1
name: large
doc: one that is heavy
params:
  mass: 1.2 kg
  arm: 0.3 m
  inertia: {value: [12, 13, 20], unit: g*m^2}
""",
    "crafts/small.yaml": """\
quadvis: 1
name: small
params: {mass: 30 g, arm: 5 cm, inertia: {value: [15, 15, 25], unit: mg*m^2}}
""",
}


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def value(diagram: quadvis.Diagram, name: str) -> Any:
    path, _, parameter = name.rpartition(".")
    return getattr(diagram.graph[path].block, parameter)


def loaded(*settings: str, **more: Any) -> quadvis.Diagram:
    return quadvis.load("craft.yaml", settings=settings, **more)


def test_a_block_takes_what_it_has_parameters_for_and_its_own_values_come_first() -> None:
    diagram = loaded()
    assert value(diagram, "body.mass") == 1.2
    assert value(diagram, "body.arm") == 0.5
    assert value(diagram, "mixer.arm") == 0.3
    assert value(diagram, "mixer.inertia") == pytest.approx([0.012, 0.013, 0.020])


def test_a_value_under_with_decides_what_two_groups_both_have(project: Path) -> None:
    one, two = "vehicle: {group: crafts/large.yaml}", "small: {group: crafts/small.yaml}"
    text = DIAGRAM.replace(one, f"{one}\n  {two}").replace(
        "group: $vehicle\n    with: {arm: 0.5 m}",
        "group: [$vehicle, $small]\n    with: {arm: 0.5 m, mass: 3 kg, inertia: $small.inertia}",
    )
    (project / "craft.yaml").write_text(text)
    diagram = loaded()
    assert (value(diagram, "body.mass"), value(diagram, "body.arm")) == (3.0, 0.5)
    assert value(diagram, "body.inertia") == pytest.approx([15e-6, 15e-6, 25e-6])


def test_a_parameter_of_a_group_is_taken_by_name_and_element() -> None:
    assert value(loaded(), "first.factor") == 0.013


def test_a_part_is_given_a_group_or_has_its_own_and_takes_single_parameters() -> None:
    diagram = loaded()
    assert (value(diagram, "inner/body.mass"), value(diagram, "inner/body.arm")) == (1.2, 0.3)
    assert (value(diagram, "other/body.mass"), value(diagram, "other/body.arm")) == (7.0, 0.05)


def test_a_setting_changes_the_group_for_all_blocks_or_one_block_alone() -> None:
    diagram = loaded("vehicle.mass=2 kg")
    assert (value(diagram, "body.mass"), value(diagram, "inner/body.mass")) == (2.0, 2.0)
    diagram = loaded("body.mass=2 kg")
    assert (value(diagram, "body.mass"), value(diagram, "inner/body.mass")) == (2.0, 1.2)


def test_a_setting_names_another_file_relative_to_the_working_directory(project: Path) -> None:
    diagram = loaded("vehicle=crafts/small.yaml", "vehicle.arm=6 cm")
    assert (value(diagram, "body.mass"), value(diagram, "mixer.arm")) == (0.03, 0.06)
    assert project / "crafts/small.yaml" in [path.resolve() for path in diagram.sources]


def test_a_parameter_file_names_another_craft(project: Path) -> None:
    (project / "set.yaml").write_text("{quadvis: 1, name: set, set: {vehicle: crafts/small.yaml}}")
    assert value(loaded(params="set.yaml"), "body.mass") == 0.03


def test_a_part_is_set_to_another_file() -> None:
    assert value(loaded("other.vehicle=crafts/large.yaml"), "other/body.arm") == 0.3


def test_the_block_of_a_variant_takes_only_what_it_asks_for() -> None:
    assert value(loaded(variant="plain"), "mixer.arm") == 0.24  # the block's default


def test_the_resolved_diagram_is_the_same_run(project: Path) -> None:
    diagram = loaded("vehicle.mass=2 kg")
    (project / "resolved.yaml").write_text(diagram.resolved)
    again = quadvis.load("resolved.yaml")
    assert again.hash == diagram.hash
    assert value(again, "body.mass") == 2.0


def test_a_change_of_the_file_changes_the_hash(project: Path) -> None:
    before = loaded().hash
    text = FILES["crafts/large.yaml"].replace("1.2 kg", "1.3 kg")
    (project / "crafts/large.yaml").write_text(text)
    assert loaded().hash != before


def test_a_misspelt_parameter_that_nothing_takes_is_a_warning_with_the_name_that_was_meant(
    project: Path,
) -> None:
    assert check("craft.yaml").warnings == ()
    text = FILES["crafts/large.yaml"].replace("arm:", "amr:") + "  colour: 3\n"
    (project / "crafts/large.yaml").write_text(text)
    (arm,) = map(str, check("craft.yaml").warnings)  # the colour is for another diagram
    assert arm == "crafts/large.yaml:6:8: warning: nothing takes 'amr' of this group; did you mean 'arm'?"


@pytest.mark.slow
def test_a_sweep_goes_over_crafts_and_over_a_parameter_of_one() -> None:
    over = {"vehicle": ["crafts/large.yaml", "crafts/small.yaml"], "vehicle.mass": ["1 kg", "2 kg"]}
    table = quadvis.sweep("craft.yaml", over, stop_time="0.1 s", workers=1)
    assert table["vehicle.mass [kg]"].tolist() == [1.0, 2.0, 1.0, 2.0]
    assert table["failure"].tolist() == [""] * 4


def test_an_analysis_varies_a_parameter_of_a_group(project: Path) -> None:
    (project / "loop.yaml").write_text(
        "{quadvis: 1, name: loop, rates: {fast: 10 Hz}, solver: {step: 0.1 s}, stop_time: 1 s,"
        " params: {law: {group: law.yaml}}, blocks: {"
        "  x: {block: signal.integrator, in: {u: {from: u.y, across: hold}}},"
        "  u: {block: signal.gain, rate: fast, group: $law, in: {u: {from: x.y, across: sample}}}},"
        " analyse: {cuts: {u: u.y}, limits: {factor: {vary: law.factor, from: -1 1/s, to: -50 1/s}}}}"
    )
    (project / "law.yaml").write_text("{quadvis: 1, name: law, params: {factor: -1 1/s}}")
    found = quadvis.load("loop.yaml").analyse()
    assert found.limits["factor"].value == pytest.approx(-20.0, rel=0.01)  # of x + T factor x


def test_the_schema_accepts_groups_and_refuses_what_is_none() -> None:
    catalogue = Catalogue()
    validator = Draft202012Validator(
        diagram_schema({name: catalogue.find(name) for name in catalogue.names()})
    )
    for text in FILES.values():
        assert not list(validator.iter_errors(yaml.safe_load(text)))
    wrong = yaml.safe_load(DIAGRAM)
    wrong["params"]["vehicle"] = {"group": "a.yaml", "mass": 1}
    assert list(validator.iter_errors(wrong))
    wrong = yaml.safe_load(DIAGRAM)
    wrong["blocks"]["body"]["group"] = "crafts/large.yaml"
    assert list(validator.iter_errors(wrong))
