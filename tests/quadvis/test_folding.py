"""Pictures of a part, and pictures whose deep parts are one box."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path

import pytest

import quadvis
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.output.drawn import DrawnBlock, DrawnWire
from quadvis.output.folding import DrawnPicture, folded, part_alone, shortened

ROOT = Path(__file__).parents[2]
A = DrawnBlock("a", "sources.step", (), ("y", "z"), "fast")
P = DrawnBlock("p/one", "signal.gain", ("u", "v"), ("y",), "fast")
Q = DrawnBlock("p/deep/two", "signal.gain", ("u",), ("y",), "slow")
R = DrawnBlock("p/deep/three", "signal.gain", ("u",), ("y",), "slow")
B = DrawnBlock("b", "signal.gain", ("u", "v", "w"), (), "fast")
PICTURE = DrawnPicture(
    [A, P, Q, R, B],
    [
        DrawnWire("a.y[0]", "p/one", "u"),
        DrawnWire("p/one.y", "p/deep/two", "u", "hold"),
        DrawnWire("p/deep/two.y[1]", "p/deep/three", "u"),
        DrawnWire("p/deep/two.y", "b", "u"),
        DrawnWire("p/deep/three.y[0:2]", "b", "v", "sample"),
        DrawnWire("a.z", "b", "w"),
    ],
    {("p/one", "v"): "3", ("b", "x"): "4"},
    {"p.effort": "p/deep/two.y", "p/deep.last": "p/deep/three.y"},
)


def test_at_depth_one_each_part_of_the_diagram_is_a_box() -> None:
    made = folded(PICTURE, 1)
    box = DrawnBlock("p", "a part of 3 blocks", ("y",), ("effort", "y"), "slow")
    assert made.blocks == [A, box, B]
    assert made.wires == [
        DrawnWire("a.y", "p", "y"),
        DrawnWire("p.effort", "b", "u"),
        DrawnWire("p.y[0:2]", "b", "v", "sample"),
        DrawnWire("a.z", "b", "w"),
    ]
    assert made.constants == {("b", "x"): "4"}


def test_a_shortened_picture_counts_the_outputs_that_lead_nowhere() -> None:
    many = DrawnBlock("c", "vision.any", ("u",), ("y", "age", "lost", "shown"), "fast", ("as it is",))
    symbol = DrawnBlock("d", "signal.any", (), ("y", "z", "w"), "fast", symbol="sum")
    wires = [DrawnWire("c.y[2]", "b", "u"), DrawnWire("a.y", "c", "u")]
    made = shortened(DrawnPicture([A, many, symbol, B], wires, {}, {"shown": "c.shown"}))
    one, short, *rest = made.blocks
    assert one == A  # a line would take as much room as the only output that leads nowhere
    assert short == replace(many, outputs=("y", "shown"), lines=("as it is", "and 2 more outputs"))
    assert rest == [symbol, B]
    assert made.wires == wires


def test_at_depth_two_the_parts_of_parts_are_boxes() -> None:
    made = folded(PICTURE, 2)
    assert [block.path for block in made.blocks] == ["a", "p/one", "p/deep", "b"]
    assert made.blocks[2].outputs == ("y", "last")
    assert DrawnWire("p/one.y", "p/deep", "y") in made.wires
    assert made.constants == PICTURE.constants
    assert folded(PICTURE, 3).wires == PICTURE.wires


def test_a_part_alone_has_its_surroundings_as_two_boxes() -> None:
    made = part_alone(PICTURE, "p")
    assert [block.path for block in made.blocks] == ["in", "one", "deep/two", "deep/three", "out"]
    assert made.blocks[0].outputs == ("y",) and made.blocks[-1].inputs == ("effort", "y")
    assert made.wires == [
        DrawnWire("in.y[0]", "one", "u"),
        DrawnWire("one.y", "deep/two", "u", "hold"),
        DrawnWire("deep/two.y[1]", "deep/three", "u"),
        DrawnWire("deep/two.y", "out", "effort"),
        DrawnWire("deep/three.y", "out", "y"),
    ]
    assert made.constants == {("one", "v"): "3"}
    assert [block.path for block in folded(made, 1).blocks] == ["in", "one", "deep", "out"]


def test_a_part_that_is_not_there_gets_a_sentence() -> None:
    with pytest.raises(QuadvisError, match=r"^the diagram has no part 'pp'; did you mean 'p'\?$"):
        part_alone(PICTURE, "pp")


@pytest.mark.slow
def test_every_part_of_a_flight_can_be_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    diagram = quadvis.load(ROOT / "diagrams" / "takeover.yaml", variant="robust")
    parts = {node.path.rpartition("/")[0] for node in diagram.graph.nodes} - {""}
    assert len(parts) >= 5
    for part in parts:
        drawn = diagram.draw(part=part)
        assert ET.fromstring(drawn).tag.endswith("svg") and f"takeover: {part}" in drawn
    whole, shallow = (ET.fromstring(diagram.draw(depth=depth)) for depth in (None, 1))
    assert float(shallow.get("width", 0)) < float(whole.get("width", 0))
    monkeypatch.chdir(tmp_path)
    command = ["draw", str(ROOT / "diagrams" / "takeover.yaml"), "--part", "control", "--depth", "1"]
    assert main(command) == 0
    assert Path("takeover-control.svg").is_file()
