"""Blocks that are drawn by a symbol: outlines, signs, where wires end, texts that fit."""

from __future__ import annotations

import itertools
import math
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from quadvis.block import Block, In, Out
from quadvis.block.symbol import CURVES, SYMBOLS
from quadvis.library.catalogue import Catalogue
from quadvis.output.draw import draw
from quadvis.output.drawn import DrawnBlock, DrawnWire
from quadvis_blocks.math.product import Product
from quadvis_blocks.signal.delay import Delay
from quadvis_blocks.signal.sum import Sum
from tests.quadvis.test_draw import SVG, extent, outline_of, passes, read, segments

TASKS = {"t": "task, 10 Hz"}


def symbol(name: str, kind: str, inputs: int = 1, outputs: int = 1, *main: str) -> DrawnBlock:
    ins, outs = tuple(f"u[{n}]" for n in range(inputs)), tuple(f"y{n}" for n in range(outputs))
    signs = {port: "+-"[number % 2] for number, port in enumerate(ins)}
    return DrawnBlock(
        name, f"kind.{kind}", ins, outs, "t", (), main, kind, (), signs if kind == "sum" else {}
    )


def groups(svg: str) -> dict[str, ElementTree.Element]:
    root = ElementTree.fromstring(svg)
    return {g.attrib["data-path"]: g for g in root.iter(f"{SVG}g") if g.get("class") == "block"}


@pytest.mark.parametrize("count", range(1, 6))
def test_the_wires_of_a_sum_end_on_its_circle_beside_their_signs(count: int) -> None:
    blocks = [symbol("s", "sum", count), *(symbol(f"b{n}", "step", 0) for n in range(count))]
    wires = [DrawnWire(f"b{n}.y0", "s", f"u[{n}]") for n in range(count)]
    svg = draw("sum", blocks, wires, {}, TASKS)
    circle = groups(svg)["s"].find(f"{SVG}circle")
    assert circle is not None
    x, y, r = (float(circle.attrib[name]) for name in ("cx", "cy", "r"))
    picture = read(svg)
    for wire in wires:
        end = picture.wires[wire.source, f"s.{wire.target_port}"][-1]
        assert math.dist(end, (x, y)) == pytest.approx(r, abs=0.2) and end[0] < x
    signs = [line for line in groups(svg)["s"].iter(f"{SVG}polyline") if line.get("stroke-width") == "1.4"]
    assert len(signs) == sum(1 if number % 2 else 2 for number in range(count))  # a plus has two strokes
    for line in signs:
        for corner in line.attrib["points"].split():
            assert math.dist(tuple(map(float, corner.split(","))), (x, y)) < r - 1


def test_the_factor_of_a_gain_stands_inside_its_triangle_or_below_it() -> None:
    short, long = symbol("a", "gain", 1, 1, "-2 N·s/m"), symbol("b", "gain", 1, 1, "[1.25, 2.5, 3.75] N·s/m")
    found = groups(draw("gains", [short, long], [], {}, TASKS))
    for path, inside in (("a", True), ("b", False)):
        area = outline_of(found[path])
        text = next(each for each in found[path].iter(f"{SVG}text") if each.text and "N" in each.text)
        box = extent(text)
        assert area.contains(box) == inside
        if inside:  # also between the two slopes
            half = (area.bottom - area.top) / 2 * (1 - (box.right - area.left) / (area.right - area.left))
            middle = (area.top + area.bottom) / 2
            assert middle - half < box.top + 2 and box.bottom - 2 < middle + half
        else:
            assert box.top >= area.bottom


@pytest.mark.parametrize("kind", CURVES)
def test_a_curve_lies_in_its_box(kind: str) -> None:
    group = groups(draw(kind, [symbol("x", kind, 1, 2, "1 m")], [], {}, TASKS))["x"]
    area = outline_of(group)
    lines = list(group.iter(f"{SVG}polyline"))
    assert lines
    for line in lines:
        for corner in line.attrib["points"].split():
            x, y = map(float, corner.split(","))
            assert area.left < x < area.right and area.top < y < area.bottom
    assert any("kind." in (title.text or "") for title in group.iter(f"{SVG}title"))


@st.composite
def pictures(draws: st.DrawFn) -> tuple[list[DrawnBlock], list[DrawnWire]]:
    count = draws(st.integers(1, 6))
    blocks = []
    for number in range(count):
        kind = draws(st.sampled_from(SYMBOLS))
        ins, outs = draws(st.integers(0, 6)), draws(st.integers(0, 3))
        main = draws(st.lists(st.sampled_from(("2 m", "-0.125 N·m/rad", "[1, 2, 3] kg")), max_size=2))
        blocks.append(symbol(f"b{number}", kind, ins, outs, *main))
    sources = [f"{block.path}.{port}" for block in blocks for port in block.outputs]
    wires = [
        DrawnWire(draws(st.sampled_from(sources)), block.path, port, draws(st.sampled_from([None, "hold"])))
        for block in blocks
        for port in block.inputs
        if sources and draws(st.booleans())
    ]
    return blocks, wires


@pytest.mark.slow
@settings(max_examples=15, suppress_health_check=list(HealthCheck))
@given(pictures())
def test_any_symbols_are_well_drawn(made: tuple[list[DrawnBlock], list[DrawnWire]]) -> None:
    blocks, wires = made
    svg = draw("any", blocks, wires, {}, TASKS)
    picture = read(svg)
    boxes = [box.outline for box in picture.boxes.values()]
    for one, other in itertools.combinations(boxes, 2):
        assert not one.overlaps(other)
    for one, other in itertools.combinations(picture.texts, 2):
        assert not one.overlaps(other)
    for (source, target), line in picture.wires.items():
        assert all(x == u or y == v for (x, y), (u, v) in itertools.pairwise(line))
        start, end = (picture.boxes[name.rpartition(".")[0]].outline for name in (source, target))
        assert line[0][0] == pytest.approx(start.right, abs=0.2)
        assert end.left - 0.2 <= line[-1][0] < (end.left + end.right) / 2
        for piece in segments(line):
            crossed = [area for area in boxes if area not in (start, end) and passes(piece, area)]
            assert not crossed, (source, target)


def test_the_library_declares_what_each_block_is() -> None:
    blocks, failures = Catalogue(Path(__file__).parent).load_all()
    assert not failures
    used = {block.symbol for block in blocks.values()}
    assert set(SYMBOLS) <= used
    assert Sum(signs="+-").with_entries(u=2).picture_signs() == {"u[0]": "+", "u[1]": "-"}
    assert Product(signs="*/").with_entries(u=2).picture_signs() == {"u[0]": "×", "u[1]": "÷"}  # noqa: RUF001
    assert Delay(steps=12).picture_formula() == ("z⁻¹²",)


def test_a_symbol_that_there_is_not_is_refused_with_the_class() -> None:
    with pytest.raises(
        TypeError, match=r"Mine has the symbol 'gian', which there is not; did you mean 'gain'"
    ):

        class Mine(Block):
            symbol = "gian"
            u = In()
            y = Out()

            def output(self, u: float) -> float:
                return u
