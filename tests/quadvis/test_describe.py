"""Words about blocks say what the declarations say, and fit a terminal."""

from __future__ import annotations

import inspect
import json
import math
import re
from pathlib import Path
from typing import Any

import pytest

from quadvis.api import load_text
from quadvis.block import Block, In, Out, Param, Safe, State
from quadvis.document import parse_yaml
from quadvis.errors import DiagramError
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import (
    default_text,
    description,
    facts,
    skeleton_entry,
    table,
)


class Sample(Block):
    """One sentence about it.

    And a paragraph.
    """

    u = In("float64[3]", unit="m", doc="what comes in")
    v = In("bool", default=True, doc="whether it is good")
    w = In(unit="s", default=math.nan, doc="when")
    y = Out("float64[3]", unit="m/s", nan=True, doc="what goes out")
    gain = Param(2.0, unit="1/s", above=0.0, max=10.0, tune=True, doc="how much")
    mode = Param("fast", choices=("fast", "slow"), doc="how")
    file = Param(type="file", doc="where from")
    shape = Param((0.0, 1.5), type="float64[2]", unit="rad", doc="in which form")
    on = Param(True, type="bool")
    count = Param(3, type="int64", min=1)
    free = Param(1.0, unit="a")
    last = State("float64[3]")

    def output(self, u: Any) -> Any:
        """Return nothing much."""
        return u

    def update(self, u: Any, v: bool, w: float) -> None:
        """Keep it."""


DESCRIPTION = """\
group.sample

One sentence about it.

And a paragraph.

inputs
  u  [3] m                                         what comes in
  v  bool   no direct feedthrough; optional, true  whether it is good
  w  s      no direct feedthrough; optional        when

outputs
  y  [3] m/s  NaN means missing  what goes out

parameters
  gain   1/s      = 2 1/s                         > 0, <= 10; tunable  how much
  mode            = fast                          fast | slow          how
  file   file     required                                             where from
  shape  [2] rad  = {value: [0, 1.5], unit: rad}                       in which form
  on     bool     = true
  count  int64    = 3                             >= 1
  free   a        = 1

states
  last  [3]

in a diagram
  sample:
    block: group.sample
    rate: ...
    with: {file: path}
    in: {u: block.port}"""


def test_a_description_lists_ports_parameters_and_states_in_columns() -> None:
    assert description("group.sample", Sample) == DESCRIPTION


def test_the_facts_are_plain_json() -> None:
    found = json.loads(json.dumps(facts("group.sample", Sample), allow_nan=False))
    assert found["block"] == "group.sample"
    assert found["inputs"]["u"] == {
        "type": "float64[3]",
        "unit": "m",
        "doc": "what comes in",
        "optional": False,
        "many": False,
    }
    assert found["inputs"]["w"]["optional"] is True
    assert found["params"]["gain"] == {
        "type": "float64", "unit": "1/s", "doc": "how much", "default": "2 1/s", "bounds": "> 0, <= 10",
        "tune": True,
    }  # fmt: skip
    assert found["params"]["mode"]["choices"] == ["fast", "slow"]
    assert found["params"]["file"]["default"] is None
    assert found["feedthrough"] == ["u"]


@pytest.mark.parametrize("name", Catalogue().names())
def test_every_default_reads_back_as_it_is(name: str) -> None:
    from quadvis.diagram.parameters import read_constant
    from quadvis.diagram.values import read_parameter

    block = Catalogue().find(name)
    for param in block.interface.params.values():
        text = default_text(param)
        if text is None or param.is_text or "inf" in text:
            continue
        from quadvis.errors import Faults

        faults = Faults()
        node = read_constant(parse_yaml(text), faults)
        assert node is not None, text
        value = param.accept(read_parameter(param, node)[0])
        assert value == pytest.approx(param.accept(param.default), rel=1e-5)


# The two left out require entries whose names are the diagram's own.
@pytest.mark.parametrize("name", sorted({*Catalogue().names()} - {"logic.state_machine", "math.expression"}))
def test_the_skeleton_of_an_entry_has_all_that_a_block_requires(name: str, tmp_path: Path) -> None:
    block = Catalogue().find(name)
    lines = "\n".join(f"  {line}" for line in skeleton_entry(name, block)).replace("rate: ...", "rate: fast")
    head = "quadvis: 1\nname: x\nrates: {fast: 1 Hz}\nstop_time: 1 s\nsolver: {step: 1 s}\nblocks:\n"
    problems: list[str] = []
    try:
        load_text(f"{head}{lines}\n", tmp_path)
    except DiagramError as error:
        problems = [fault.problem for fault in error.faults]
    # What is left to be filled in is all that may be wrong: block.port, path, and ... also for a list.
    lists = [f"'{param.name}' takes" for param in block.interface.params.values() if param.required]
    left = ("'block'", "'block.port'", "path", "the arrays of a '' file", "'...'", *lists)
    assert [problem for problem in problems if not any(word in problem for word in left)] == []


def test_long_words_wrap_in_their_own_column() -> None:
    rows = [("a", "one two three four five six seven eight nine ten"), ("bcd", "eleven")]
    assert table(rows, 36) == [
        "a    one two three four five six",
        "     seven eight nine ten",
        "bcd  eleven",
    ]


@pytest.mark.parametrize("name", Catalogue().names())
def test_a_description_fits_a_terminal(name: str) -> None:
    _, _, tables = description(name, Catalogue().find(name), 120).rpartition(
        f"{inspect.getdoc(Catalogue().find(name))}"
    )
    assert max(map(len, tables.splitlines())) <= 120


def test_many_choices_stand_where_the_text_wraps() -> None:
    text = description("vision.frame_fault", Catalogue().find("vision.frame_fault"), 100)
    assert "39 choices" in text
    for kind in ("none", "freeze", "half_before", "no_pixels"):
        assert f"{kind}," in text or f"{kind}\n" in text


def test_an_empty_table_has_no_lines() -> None:
    assert table([]) == []
    assert table([("", "")]) == [""]


def test_what_sets_a_block_apart_is_said_with_its_reason() -> None:
    class Servo(Block, numeric=False):
        """A servo."""

        not_replayable = "it reads a sensor"
        angle = In("float64[2]", unit="rad", doc="wanted")
        rest = Safe("angle", doc="angle when the run ends")

        def write(self, angle):
            raise NotImplementedError

    text = description("own.servo", Servo)
    assert "\nA servo.\n\nnot replayable: it reads a sensor\n\ninputs\n" in text
    assert re.search(r"rest +\[2\] rad +required +safe value of angle +angle when the run ends", text)
    found = facts("own.servo", Servo)
    assert (found["tags"], found["safe"]) == ({"not replayable": "it reads a sensor"}, {"angle": "rest"})
