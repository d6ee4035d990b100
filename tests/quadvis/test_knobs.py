"""Parameters of the diagram and of parts that are tuned in all blocks which have their value."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.api import Diagram
from quadvis.engine.tuning import NewValue
from quadvis.errors import QuadvisError
from quadvis.run.tuned import new_values, tunable_names

DIAGRAM = """\
quadvis: 1
name: knobs
rates: {base: 10 Hz}
stop_time: 1 s
params:
  amount: 2 m
  most: 3 m
  start: 1 m
  length: -4 m
  level: 5 m
  spare: {value: [1, 2]}
  craft: {group: craft.yaml}
blocks:
  source: {block: sources.constant, rate: base, with: {value: 1 m}}
  late: {block: signal.unit_delay, rate: base, with: {initial: $start}, in: {u: source.y}}
  own: {block: signal.saturation, rate: base, with: {lower: -9 m, upper: $most}, in: {u: source.y}}
  first: {part: part.yaml, with: {top: $most, under: $length}, in: {u: own.y}}
  second: {part: part.yaml, with: {top: $amount, craft: $craft}, in: {u: $length}}
  list: {block: sources.constant, rate: base, with: {value: [$level, $craft.other]}}
expect:
  - {signal: own.y, within: $level}
"""
PART = """\
quadvis: 1
name: part
params:
  top: 1 m
  under: -7 m
  unused: 4 m
  craft: {group: craft.yaml}
blocks:
  inner: {part: inner.yaml, with: {upper: $top, craft: $craft}, in: {u: in.u}}
  clip: {block: signal.saturation, rate: base, with: {lower: $under, upper: $top}, in: {u: inner.y}}
ports: {in: [u], out: {y: clip.y}}
"""
INNER = """\
quadvis: 1
name: inner
params: {upper: 1 m, craft: {group: craft.yaml}}
blocks:
  clip: {block: signal.saturation, rate: base, with: {lower: -8 m, upper: $upper}, in: {u: in.u}}
  held: {block: signal.hold_valid, rate: base, with: {max_age: $craft.age}, in: {value: clip.y}}
ports: {in: [u], out: {y: clip.y}}
"""
GROUP = """\
quadvis: 1
name: craft
params: {age: 2 s, other: 1 m}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in {"knobs": DIAGRAM, "part": PART, "inner": INNER, "craft": GROUP}.items():
        (tmp_path / f"{name}.yaml").write_text(text)
    return tmp_path


@pytest.fixture
def diagram(folder: Path) -> Diagram:
    return quadvis.load(folder / "knobs.yaml")


def paths(diagram: Diagram, name: str, value: Any = 1.5) -> dict[str, Any]:
    return {f"{new.path}.{new.name}": new.value for new in new_values(diagram, {name: value})}


@pytest.mark.parametrize(
    ("name", "reached"),
    [
        ("most", ["own.upper", "first/inner/clip.upper", "first/clip.upper"]),
        ("amount", ["second/inner/clip.upper", "second/clip.upper"]),
        ("first.top", ["first/inner/clip.upper", "first/clip.upper"]),
        ("first/inner.upper", ["first/inner/clip.upper"]),
        ("first.under", ["first/clip.lower"]),
        ("second.under", ["second/clip.lower"]),
        ("second/clip.upper", ["second/clip.upper"]),
    ],
)
def test_a_parameter_reaches_all_blocks_that_have_its_value(
    diagram: Diagram, name: str, reached: list[str]
) -> None:
    assert sorted(paths(diagram, name, "150 cm")) == sorted(reached)
    assert set(paths(diagram, name, "150 cm").values()) == {1.5}
    assert name in tunable_names(diagram)


def test_a_value_of_a_group_goes_through_parts(folder: Path, diagram: Diagram) -> None:
    assert diagram.knobs["craft.age"].targets == (("second/inner/held", "max_age"),)
    text = DIAGRAM.replace(", $craft.other]", ", 1 m]")
    (folder / "knobs.yaml").write_text(text)
    assert paths(quadvis.load(folder / "knobs.yaml"), "craft.age", "3 s") == {
        "second/inner/held.max_age": 3.0
    }


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("start", r"'start' cannot be tuned, since it also gives its value to 'late\.initial'"),
        ("length", r"to the input 'second\.u'"),
        ("level", r"to a part of 'list\.value', 'expect'"),
        ("craft.age", r"to a part of 'list\.value'"),
        ("spare", "since no block has its value"),
        ("first.unused", "since no block has its value"),
        ("mots", "this run has no 'mots'; did you mean 'most'"),
        ("first.tpo", "this run has no 'first.tpo'; did you mean 'first.top'"),
        ("most", "most: .*3 s.* m"),
    ],
)
def test_what_cannot_be_tuned_is_refused_in_words(diagram: Diagram, name: str, words: str) -> None:
    with pytest.raises(QuadvisError, match=words):
        new_values(diagram, {name: "3 s"})
    assert name in tunable_names(diagram) or name != "most"


def test_a_setting_takes_its_block_or_part_away(folder: Path) -> None:
    changed = quadvis.load(folder / "knobs.yaml", settings=["own.upper=6 m", "first.top=5 m", "most=4 m"])
    assert changed.knobs["most"].targets == ()
    assert len(changed.knobs["first.top"].targets) == 2


def test_values_of_several_names_are_one_group(diagram: Diagram) -> None:
    found = new_values(diagram, {"own.lower": -1, "amount": "2 m"})
    assert found[0] == NewValue("own", "lower", -1) and len(found) == 3


def test_a_live_run_takes_these_names(diagram: Diagram) -> None:
    with diagram.start() as run:
        run.advance()
        run["most"] = "20 cm"
        run.advance()
        assert (run["own.y"], run["first/clip.upper"], run["most"]) == (0.2, 0.2, 0.2)
        assert {change.tick for change in run.changes} == {1} and len(run.changes) == 3
