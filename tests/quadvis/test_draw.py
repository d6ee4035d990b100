"""The drawing is judged by its SVG alone: parsed as XML, measured with the metrics of DejaVu Sans."""

from __future__ import annotations

import hashlib
import itertools
import re
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import TextPath

import quadvis.output.elkjs
from quadvis.errors import QuadvisError
from quadvis.output.draw import draw
from quadvis.output.drawn import DrawnBlock, DrawnWire
from quadvis.output.elkjs import LayoutError
from tests.stages import mostly_slow

SVG = "{http://www.w3.org/2000/svg}"
TASKS = {
    "continuous": "continuous, ode4 at 200 Hz",
    "imu": "imu, 100 Hz (10 ms)",
    "control": "control, 20 Hz (50 ms)",
    "vision": "vision, 10 Hz (100 ms)",
}

Large = tuple[list[DrawnBlock], list[DrawnWire]]


@dataclass(frozen=True)
class Rectangle:
    left: float
    top: float
    right: float
    bottom: float

    @classmethod
    def of(cls, element: ElementTree.Element) -> Rectangle:
        x, y, width, height = (float(element.get(name, "0")) for name in ("x", "y", "width", "height"))
        return cls(x, y, x + width, y + height)

    def overlaps(self, other: Rectangle, slack: float = 0.3) -> bool:
        return (
            self.left < other.right - slack
            and other.left < self.right - slack
            and self.top < other.bottom - slack
            and other.top < self.bottom - slack
        )

    def contains(self, other: Rectangle, slack: float = 0.3) -> bool:
        return (
            self.left <= other.left + slack
            and self.top <= other.top + slack
            and self.right >= other.right - slack
            and self.bottom >= other.bottom - slack
        )


@dataclass
class Box:
    outline: Rectangle
    texts: dict[str, list[ElementTree.Element]] = field(default_factory=dict)

    def port_height(self, name: str, *, output: bool) -> float:
        """The middle of a port's name, which is written 4 px above the base line."""
        side = "end" if output else "start"
        (text,) = (text for text in self.texts[name] if text.get("text-anchor") == side)
        return float(text.get("y", "0")) - 4


@dataclass
class Picture:
    root: ElementTree.Element
    boxes: dict[str, Box] = field(default_factory=dict)
    parts: dict[str, Rectangle] = field(default_factory=dict)
    titles: list[Rectangle] = field(default_factory=list)
    wires: dict[tuple[str, str], list[tuple[float, float]]] = field(default_factory=dict)
    marks: list[ElementTree.Element] = field(default_factory=list)
    texts: list[Rectangle] = field(default_factory=list)


@cache  # the same few words stand in most pictures
def length(text: str, size: float, weight: str) -> float:
    font = FontProperties(family="DejaVu Sans", weight=weight)
    path = TextPath((0, 0), text.replace("$", "S"), size=size, prop=font)
    return float(path.get_extents().width) if len(path.vertices) else 0.0


def extent(text: ElementTree.Element) -> Rectangle:
    """Where a text stands if it is set in DejaVu Sans, the widest of the usual sans-serif faces."""
    size = float(text.get("font-size", "0"))
    width = length(text.text or " ", size, text.get("font-weight", "normal"))
    x, y = float(text.get("x", "0")), float(text.get("y", "0"))
    left = {"start": x, "middle": x - width / 2, "end": x - width}[text.get("text-anchor", "start")]
    return Rectangle(left, y - 0.76 * size, left + width, y + 0.1 * size)


def outline_of(group: ElementTree.Element) -> Rectangle:
    """The rectangle around the outline of a block."""
    shape = next(each for each in group if each.get("class") == "outline")
    if shape.tag == f"{SVG}circle":
        x, y, r = (float(shape.attrib[name]) for name in ("cx", "cy", "r"))
        return Rectangle(x - r, y - r, x + r, y + r)
    if shape.tag == f"{SVG}polygon":
        corners = [tuple(map(float, corner.split(","))) for corner in shape.attrib["points"].split()]
        (left, top), (right, bottom) = (
            map(min, zip(*corners, strict=True)),
            map(max, zip(*corners, strict=True)),
        )
        return Rectangle(left, top, right, bottom)
    return Rectangle.of(shape)


def read(svg: str, *, texts: bool = True) -> Picture:
    picture = Picture(ElementTree.fromstring(svg))
    groups = list(picture.root.iter(f"{SVG}g"))
    for group in groups:
        role, rectangle = group.get("class"), group.find(f"{SVG}rect")
        if role == "block":
            box = Box(outline_of(group))
            for text in group.findall(f"{SVG}text"):
                box.texts.setdefault(text.text or "", []).append(text)
            picture.boxes[group.attrib["data-path"]] = box
        elif role == "part":
            picture.parts[group.attrib["data-path"]] = Rectangle.of(rectangle)
            picture.titles.append(extent(group.find(f"{SVG}text")))
        elif role == "wire":
            corners = group.find(f"{SVG}polyline").attrib["points"].split()
            line = [(float(x), float(y)) for x, y in (corner.split(",") for corner in corners)]
            picture.wires[group.attrib["data-source"], group.attrib["data-target"]] = line
        elif role == "mark":
            picture.marks.append(group)
    diagram = groups[1]
    if texts:
        picture.texts = [extent(text) for text in diagram.iter(f"{SVG}text")]
    return picture


def segments(line: list[tuple[float, float]]) -> list[Rectangle]:
    """The straight pieces of a wire, as rectangles without an inside."""
    return [
        Rectangle(min(x, u), min(y, v), max(x, u), max(y, v)) for (x, y), (u, v) in itertools.pairwise(line)
    ]


def passes(piece: Rectangle, area: Rectangle) -> bool:
    """Whether a piece of wire runs through the interior of an area."""
    return (
        piece.left < area.right - 0.5
        and piece.right > area.left + 0.5
        and piece.top < area.bottom - 0.5
        and piece.bottom > area.top + 0.5
    )


def assert_well_drawn(picture: Picture, blocks: list[DrawnBlock], wires: list[DrawnWire]) -> None:
    """Every promise of a legible drawing that holds whatever the diagram."""
    assert list(picture.boxes) == [block.path for block in blocks]
    assert len(picture.wires) == len({(w.source, w.target_block, w.target_port) for w in wires})
    for one, other in itertools.combinations(picture.boxes.values(), 2):
        assert not one.outline.overlaps(other.outline)
    for path, box in picture.boxes.items():
        for part, frame in picture.parts.items():
            inside = path.startswith(f"{part}/")
            assert frame.contains(box.outline) if inside else not frame.overlaps(box.outline), (path, part)
    for wire in wires:
        assert_ends_at_its_ports(picture, wire)
    for (source, target), line in picture.wires.items():
        assert all(x == u or y == v for (x, y), (u, v) in itertools.pairwise(line)), (source, target)
        for piece in segments(line):
            assert not any(passes(piece, box.outline) for box in picture.boxes.values()), (source, target)
            assert not any(passes(piece, title) for title in picture.titles), (source, target)
    for mark in picture.marks:
        pill = mark.find(f"{SVG}rect")
        area = extent(mark.find(f"{SVG}text")) if pill is None else Rectangle.of(pill)
        through = [line for line in picture.wires.values() if any(passes(p, area) for p in segments(line))]
        assert len(through) == (0 if pill is None else 1)
    size = Rectangle.of(picture.root)
    for box in picture.boxes.values():
        assert size.contains(box.outline)


def assert_ends_at_its_ports(picture: Picture, wire: DrawnWire) -> None:
    line = picture.wires[wire.source, f"{wire.target_block}.{wire.target_port}"]
    block, _, port = re.sub(r"\[.*\]$", "", wire.source).rpartition(".")
    source, target = picture.boxes[block], picture.boxes[wire.target_block]
    assert line[0] == pytest.approx((source.outline.right, source.port_height(port, output=True)), abs=0.15)
    assert line[-1] == pytest.approx(
        (target.outline.left, target.port_height(wire.target_port, output=False)), abs=0.15
    )


def assert_texts_apart(picture: Picture) -> None:
    for one, other in itertools.combinations(picture.texts, 2):
        assert not one.overlaps(other)
    for path, box in picture.boxes.items():
        for text in itertools.chain.from_iterable(box.texts.values()):
            assert box.outline.contains(extent(text)), (path, text.text)


def block(
    path: str, inputs: str = "", outputs: str = "", task: str = "control", kind: str = ""
) -> DrawnBlock:
    return DrawnBlock(
        path, kind or f"signal.{path.rpartition('/')[2]}", tuple(inputs.split()), tuple(outputs.split()), task
    )


def hover() -> tuple[list[DrawnBlock], list[DrawnWire], dict[tuple[str, str], str]]:
    """A vision-guided hover: 17 blocks, 4 rates, 3 parts, the loop closed through the plant."""
    v, e, c = "vision/", "estimation/", "control/"
    pitch_and_roll = "position velocity angle rate"
    blocks = [
        block("plant", "thrust wind", "position velocity attitude rates", "continuous", "plant.rotorcraft"),
        block("radio", "u", "y", "continuous", "signal.transport_delay"),
        block("gust", "", "wind", "imu", "plant.gust"),
        block("imu", "attitude rates", "roll pitch gyro", "imu", "sensors.imu"),
        block(v + "camera", "position attitude", "frame", "vision", "vision.rendered_camera"),
        block(
            v + "detector", "frame", "centres quality status found stamp", "vision", "vision.circle_detector"
        ),
        block(v + "pose", "centres", "position yaw valid", "vision", "vision.pose_n_points"),
        block(e + "place", "position", "position", "vision", "estimation.vehicle_position"),
        block(e + "held", "value valid", "value", "vision", "signal.hold_valid"),
        block(e + "velocity", "value stamp valid", "rate", "vision", "signal.derivative"),
        block(c + "setpoint", "target", "height yaw", "control", "control.setpoint"),
        block(c + "heading", "position velocity yaw", "position velocity", kind="control.heading_rotation"),
        block(c + "roll", pitch_and_roll, "torque", kind="control.nested_saturation"),
        block(c + "pitch", pitch_and_roll, "torque", kind="control.nested_saturation"),
        block(c + "altitude", "height velocity roll pitch reference", "thrust", kind="control.altitude"),
        block(c + "yaw", "yaw rate reference", "torque", kind="control.yaw"),
        block("mixer", "thrust roll pitch yaw", "thrust saturated", kind="control.mixer"),
    ]
    wired = {
        "plant": "thrust=radio.y wind=gust.wind:hold",
        "radio": "u=mixer.thrust:hold",
        "imu": "attitude=plant.attitude:sample rates=plant.rates:sample",
        v + "camera": "position=plant.position:sample attitude=plant.attitude:sample",
        v + "detector": f"frame={v}camera.frame",
        v + "pose": f"centres={v}detector.centres",
        e + "place": f"position={v}pose.position",
        e + "held": f"value={e}place.position valid={v}pose.valid",
        e + "velocity": f"value={e}held.value stamp={v}detector.stamp valid={v}pose.valid",
        c + "heading": f"position={e}held.value:hold velocity={e}velocity.rate:hold yaw={v}pose.yaw:hold",
        c + "roll": f"position={c}heading.position[1] velocity={c}heading.velocity[1] "
        "angle=imu.roll:sample rate=imu.gyro[0]:sample",
        c + "pitch": f"position={c}heading.position[0] velocity={c}heading.velocity[0] "
        "angle=imu.pitch:sample rate=imu.gyro[1]:sample",
        c
        + "altitude": f"height={e}held.value[2]:hold velocity={e}velocity.rate[2]:hold roll=imu.roll:sample "
        f"pitch=imu.pitch:sample reference={c}setpoint.height",
        c + "yaw": f"yaw={v}pose.yaw:newest rate=imu.gyro[2]:sample reference={c}setpoint.yaw",
        "mixer": f"thrust={c}altitude.thrust roll={c}roll.torque pitch={c}pitch.torque yaw={c}yaw.torque",
    }
    wires = []
    for target, inputs in wired.items():
        for entry in inputs.split():
            port, _, rest = entry.partition("=")
            source, _, crossing = rest.partition(":")
            wires.append(DrawnWire(source, target, port, crossing or None))
    return blocks, wires, {(c + "setpoint", "target"): "[0, 0, 1.5 m, 0 rad]"}


@pytest.fixture(scope="module")
def hover_svg() -> str:
    blocks, wires, constants = hover()
    return draw("hover", blocks, wires, constants, TASKS)


def test_hover_is_well_drawn(hover_svg: str) -> None:
    blocks, wires, _ = hover()
    picture = read(hover_svg)
    assert_well_drawn(picture, blocks, wires)
    assert_texts_apart(picture)
    assert set(picture.parts) == {"vision", "estimation", "control"}


def test_hover_reads_from_left_to_right_with_one_wire_back(hover_svg: str) -> None:
    back = [ends for ends, line in read(hover_svg).wires.items() if line[-1][0] < line[0][0]]
    assert back == [("radio.y", "plant.thrust")]


def test_a_box_shows_name_type_and_ports(hover_svg: str) -> None:
    box = read(hover_svg).boxes["vision/camera"]
    assert set(box.texts) == {"camera", "vision.rendered_camera", "position", "attitude", "frame"}
    (name,), (kind,) = box.texts["camera"], box.texts["vision.rendered_camera"]
    assert float(kind.attrib["font-size"]) < float(name.attrib["font-size"])


def test_every_text_is_at_least_ten_pixels_high_in_a_generic_face(hover_svg: str) -> None:
    root = ElementTree.fromstring(hover_svg)
    assert root.get("font-family") == "sans-serif"
    assert min(float(text.attrib["font-size"]) for text in root.iter(f"{SVG}text")) >= 10


def test_the_background_is_painted_for_dark_viewers(hover_svg: str) -> None:
    root = ElementTree.fromstring(hover_svg)
    background = root.find(f"{SVG}rect")
    assert background.get("fill") == "#ffffff"
    assert (background.get("width"), background.get("height")) == (root.get("width"), root.get("height"))


def test_wires_between_rates_say_how_they_cross_and_which_element_they_take(hover_svg: str) -> None:
    _, wires, constants = hover()
    shown = sorted(mark.find(f"{SVG}text").text or "" for mark in read(hover_svg).marks)
    elements = [wire.source[wire.source.find("[") :] if "[" in wire.source else "" for wire in wires]
    crossings = [f"{e} {wire.crossing or ''}".strip() for e, wire in zip(elements, wires, strict=True)]
    assert shown == sorted([text for text in crossings if text] + list(constants.values()))


def test_blocks_of_one_task_share_a_colour_that_the_legend_names(hover_svg: str) -> None:
    blocks, _, _ = hover()
    root = ElementTree.fromstring(hover_svg)
    groups = {g.get("data-path"): g for g in root.iter(f"{SVG}g") if g.get("class") == "block"}
    fills: dict[str, set[str]] = {}
    for drawn in blocks:
        fills.setdefault(drawn.task, set()).add(groups[drawn.path].find(f"{SVG}rect").attrib["fill"])
    assert all(len(colours) == 1 for colours in fills.values())
    assert len(set.union(*fills.values())) == len(TASKS)
    legend = root.find(f"{SVG}g")
    entries = zip(legend.findall(f"{SVG}rect"), legend.findall(f"{SVG}text"), strict=True)
    named = {text.text: swatch.attrib["fill"] for swatch, text in entries}
    assert {TASKS[task]: colours.pop() for task, colours in fills.items()}.items() <= named.items()


@pytest.mark.slow
def test_equal_diagrams_give_equal_bytes_in_every_process(hover_svg: str) -> None:
    blocks, wires, constants = hover()
    assert draw("hover", blocks, wires, constants, TASKS) == hover_svg
    program = (
        "import sys; from quadvis.output.draw import draw; from quadvis.output.drawn import *; "
        "b = [DrawnBlock('a', 'k', ('u',), ('y',), 't')]; "
        "sys.stdout.write(draw('self', b, [DrawnWire('a.y', 'a', 'u')], {}, {'t': 't'}))"
    )
    once, again = (
        subprocess.run(
            [sys.executable, "-c", program], capture_output=True, check=True, env=environment
        ).stdout
        for environment in (
            {"PYTHONHASHSEED": seed, "PYTHONPATH": ":".join(sys.path), "PYTHONUTF8": "1"} for seed in "12"
        )
    )
    assert once == again
    assert once.startswith(b"<svg")


def test_one_block_alone_is_drawn() -> None:
    alone = [block("alone")]
    picture = read(draw("alone", alone, [], {}, TASKS))
    assert_well_drawn(picture, alone, [])
    assert_texts_apart(picture)


def test_no_blocks_give_an_empty_picture_with_a_title() -> None:
    root = ElementTree.fromstring(draw("nothing yet", [], [], {}, TASKS))
    assert root.find(f"{SVG}title").text == "nothing yet"


def test_blocks_without_wires_are_drawn_apart() -> None:
    blocks = [block(f"b{i}", "u v", "y") for i in range(5)]
    picture = read(draw("loose", blocks, [], {("b0", "u"): "1", ("b0", "v"): "2 m"}, TASKS))
    assert_well_drawn(picture, blocks, [])
    assert_texts_apart(picture)


def test_lines_stand_at_the_foot_of_a_box_below_its_ports() -> None:
    lines = ("idle → run: level > high", "run → idle: after 0.2 s, a condition that is longer than the ports")
    plain, tall = (
        DrawnBlock("mode", "logic.x", ("u",), ("y", "z"), next(iter(TASKS)), each) for each in ((), lines)
    )
    boxes = []
    for block in (plain, tall):
        picture = ElementTree.fromstring(draw("machine", [block], [], {}, TASKS))
        group = next(each for each in picture.iter(f"{SVG}g") if each.get("data-path") == "mode")
        box = next(group.iter(f"{SVG}rect"))
        boxes.append((group, *(float(box.get(key, "0")) for key in ("x", "y", "width", "height"))))
    (_, _, _, width, height), (group, x, y, wide, high) = boxes
    assert wide > width
    assert high > height + 20
    texts = {each.text: each for each in group.iter(f"{SVG}text")}
    ports = max(float(texts[name].get("y", "0")) for name in ("u", "y", "z"))
    feet = [float(texts[line].get("y", "0")) for line in lines]
    assert ports < feet[0] < feet[1] < y + high
    assert all(float(texts[line].get("x", "0")) > x for line in lines)


def test_a_block_wired_to_itself_is_drawn() -> None:
    blocks = [block("integrator", "u", "y"), block("sink", "u")]
    wires = [DrawnWire("integrator.y", "integrator", "u", "delay"), DrawnWire("integrator.y", "sink", "u")]
    assert_well_drawn(read(draw("self", blocks, wires, {}, TASKS)), blocks, wires)


def test_parts_within_parts_are_framed_with_their_own_names() -> None:
    blocks = [
        block("outer/inner/a", "u", "y"),
        block("outer/inner with a rather long name/b", "u", "y"),
        block("outer/c", "u", "y"),
        block("d", "u", "y"),
    ]
    ring = [*blocks[1:], blocks[0]]
    wires = [DrawnWire(f"{a.path}.y", b.path, "u") for a, b in zip(blocks, ring, strict=True)]
    svg = draw("nested", blocks, wires, {}, TASKS)
    picture = read(svg)
    assert_well_drawn(picture, blocks, wires)
    assert_texts_apart(picture)
    assert picture.parts["outer"].contains(picture.parts["outer/inner"])
    for frame, title in zip(picture.parts.values(), picture.titles, strict=True):
        assert frame.contains(title)
    assert ">inner with a rather long name</text>" in svg


def test_odd_characters_survive_or_are_replaced() -> None:
    odd = "a<b>&\"'ψ飛"
    blocks = [DrawnBlock(odd, "k&<ind>", ("in.put" + odd, "\x00\ud800"), (odd,), "t<")]
    svg = draw(odd, blocks, [], {(odd, "\x00\ud800"): "]]>\x1b"}, {"t<": '<&">'})
    root = ElementTree.fromstring(svg.encode("utf-8"))
    texts = {text.text for text in root.iter(f"{SVG}text")}
    assert {odd, "k&<ind>", f"in.put{odd}", "\ufffd\ufffd", "]]>\ufffd", '<&">'} <= texts


def test_long_constants_are_shortened_and_kept_whole_in_the_tooltip() -> None:
    value = ", ".join(map(str, range(40)))
    (mark,) = read(draw("long", [block("b", "u")], [], {("b", "u"): value}, TASKS)).marks
    assert mark.find(f"{SVG}title").text == value
    assert len(mark.find(f"{SVG}text").text) < 40


names = st.text("abcxyz_", min_size=1, max_size=9)


Drawn = tuple[list[DrawnBlock], list[DrawnWire]]


@st.composite
def diagrams(draws: st.DrawFn) -> Drawn:
    paths = draws(
        st.lists(
            st.tuples(st.sampled_from(["", "p/", "p/q/", "r/"]), names), min_size=1, max_size=7, unique=True
        )
    )
    blocks = []
    for number, (part, name) in enumerate(paths):
        ins, outs = (draws(st.lists(names, max_size=4, unique=True)) for _ in "io")
        ins, outs = [f"i{name}" for name in ins], [f"o{name}" for name in outs]
        task = draws(st.sampled_from(sorted(TASKS)))
        blocks.append(DrawnBlock(f"{part}B{number}{name}", f"kind.{name}", tuple(ins), tuple(outs), task))
    outputs = [f"{b.path}.{port}" for b in blocks for port in b.outputs]
    wires = [
        DrawnWire(draws(st.sampled_from(outputs)), b.path, port, draws(st.sampled_from([None, "hold"])))
        for b in blocks
        for port in b.inputs
        if outputs and draws(st.integers(0, 3))
    ]
    return blocks, wires


@pytest.mark.slow
@settings(max_examples=5, suppress_health_check=list(HealthCheck))
@given(diagrams())
def test_any_diagram_is_well_drawn(diagram: Drawn) -> None:
    assert_drawn_well(diagram)


@pytest.mark.slow
@settings(max_examples=15, suppress_health_check=list(HealthCheck))
@given(diagrams())
def test_many_more_diagrams_are_well_drawn(diagram: Drawn) -> None:
    assert_drawn_well(diagram)


@pytest.mark.slow
@settings(max_examples=5, suppress_health_check=list(HealthCheck))
@given(diagrams(), st.sampled_from([0.5, 1.0, 2.0]))
def test_any_diagram_is_well_drawn_with_wrapped_columns(diagram: Drawn, aspect: float) -> None:
    assert_drawn_well(diagram, aspect)


def test_wrapped_columns_stand_below_one_another() -> None:
    blocks = [DrawnBlock(f"b{n}", "signal.gain", ("u",) if n else (), ("y",), "imu") for n in range(24)]
    wires = [DrawnWire(f"b{n}.y", f"b{n + 1}", "u") for n in range(23)]
    sizes = []
    for aspect in (None, 1.4):
        picture = ElementTree.fromstring(draw("chain", blocks, wires, {}, TASKS, aspect=aspect))
        sizes.append((float(picture.get("width", "0")), float(picture.get("height", "0"))))
    (long, flat), (width, height) = sizes
    assert long > 10 * flat
    assert 0.7 < width / height < 2.8


def assert_drawn_well(diagram: Drawn, aspect: float | None = None) -> None:
    blocks, wires = diagram
    picture = read(draw("any", blocks, wires, {}, TASKS, aspect=aspect))
    assert_well_drawn(picture, blocks, wires)
    assert_texts_apart(picture)


@pytest.mark.slow
def test_a_hundred_blocks_in_a_loop_are_well_drawn() -> None:
    blocks = [
        block(f"part{i // 10}/b{i}" if i % 10 else f"b{i}", "u v", "y", sorted(TASKS)[i % 4])
        for i in range(100)
    ]
    wires = [DrawnWire(f"{blocks[i - 1].path}.y", b.path, "u", "hold") for i, b in enumerate(blocks)]
    wires += [DrawnWire(f"{blocks[(7 * i) // 8].path}.y", b.path, "v") for i, b in enumerate(blocks) if i % 3]
    assert_well_drawn(read(draw("hundred", blocks, wires, {}, TASKS)), blocks, wires)


@pytest.mark.parametrize(
    ("wire", "constants", "words"),
    [
        (DrawnWire("nobody.y", "a", "u"), {}, "block 'nobody' is not among the blocks"),
        (DrawnWire("a.y", "nobody", "u"), {}, "block 'nobody' is not among the blocks"),
        (DrawnWire("a.z", "a", "u"), {}, "block 'a' has no output 'z'; it has y"),
        (DrawnWire("a.y", "a", "w"), {}, "block 'a' has no input 'w'; it has u"),
        (DrawnWire("a", "a", "u"), {}, "must start at 'block.port'"),
        (DrawnWire("a.y", "a", "u"), {("a", "gain"): "3"}, "block 'a' has no input 'gain'"),
    ],
)
def test_contradictions_are_named(wire: DrawnWire, constants: dict[tuple[str, str], str], words: str) -> None:
    with pytest.raises(QuadvisError, match=re.escape(words)):
        draw("wrong", [block("a", "u", "y")], [wire], constants, TASKS)


def test_a_path_drawn_twice_and_an_unknown_task_are_named() -> None:
    with pytest.raises(QuadvisError, match="block 'a' is drawn twice"):
        draw("twice", [block("a"), block("a", "u")], [], {}, TASKS)
    with pytest.raises(QuadvisError, match="task 'night' is not in the legend"):
        draw("unknown", [replace(block("a"), task="night")], [], {}, TASKS)


def test_a_missing_engine_is_one_sentence_with_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "quickjs", None)
    with pytest.raises(QuadvisError, match="pip install quickjs-ng") as caught:
        draw("none", [block("a")], [], {}, TASKS)
    assert "\n" not in str(caught.value)


def test_a_layout_that_takes_too_long_is_given_up_for_a_simpler_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("quadvis.output.elkjs.TIME_LIMIT", 0.01)
    with pytest.raises(LayoutError, match="could not be laid out"):
        quadvis.output.elkjs.layout({"id": "root", "children": [], "edges": []})
    blocks, wires, constants = hover()
    assert_well_drawn(read(draw("slow", blocks, wires, constants, TASKS)), blocks, wires)


@pytest.fixture
def simple(monkeypatch: pytest.MonkeyPatch) -> None:
    """Have all diagrams placed by the layout for large ones."""
    monkeypatch.setattr("quadvis.output.draw.MOST_BLOCKS", -1)


@pytest.mark.usefixtures("simple")
def test_hover_is_well_drawn_by_the_layout_for_large_diagrams() -> None:
    blocks, wires, constants = hover()
    svg = draw("hover", blocks, wires, constants, TASKS)
    picture = read(svg)
    assert_well_drawn(picture, blocks, wires)
    assert_texts_apart(picture)
    assert set(picture.parts) == {"vision", "estimation", "control"}
    assert draw("hover", blocks, wires, constants, TASKS) == svg


@pytest.mark.usefixtures("simple")
@settings(suppress_health_check=list(HealthCheck))
@given(diagrams())
def test_any_diagram_is_well_drawn_by_the_layout_for_large_ones(
    diagram: tuple[list[DrawnBlock], list[DrawnWire]],
) -> None:
    blocks, wires = diagram
    assert_well_drawn(read(draw("any", blocks, wires, {}, TASKS), texts=False), blocks, wires)


def chain(count: int) -> Large:
    blocks = [block(f"b{i}", "u" if i else "", "y") for i in range(count)]
    return blocks, [DrawnWire(f"b{i}.y", f"b{i + 1}", "u") for i in range(count - 1)]


def ring(count: int) -> Large:
    blocks = [block(f"b{i}", "u", "y") for i in range(count)]
    return blocks, [DrawnWire(f"b{i}.y", f"b{(i + 1) % count}", "u", "hold") for i in range(count)]


def apart(count: int) -> Large:
    return [block(f"b{i}", "u v", "y") for i in range(count)], []


def fan(count: int) -> Large:
    blocks = [block("source", "", "y"), *(block(f"b{i}", "u", "y") for i in range(count - 1))]
    return blocks, [DrawnWire("source.y", b.path, "u", "hold") for b in blocks[1:]]


def funnel(count: int) -> Large:
    ports = " ".join(f"u{i}" for i in range(count - 1))
    blocks = [*(block(f"b{i}", "", "y") for i in range(count - 1)), block("sink", ports)]
    return blocks, [DrawnWire(f"b{i}.y", "sink", f"u{i}") for i in range(count - 1)]


def tree(count: int) -> Large:
    blocks = [block(f"b{i}", "u" if i else "", "y") for i in range(count)]
    return blocks, [DrawnWire(f"b{(i - 1) // 3}.y", f"b{i}", "u") for i in range(1, count)]


def pairs(count: int) -> Large:
    blocks = [block(f"b{i}", "u" if i % 2 else "", "y") for i in range(count)]
    return blocks, [DrawnWire(f"b{i}.y", f"b{i + 1}", "u") for i in range(0, count - 1, 2)]


def parts(count: int) -> Large:
    blocks = [block(f"p{i // 100}/q{i // 10}/b{i}", "u v", "y z") for i in range(count)]
    wires = [DrawnWire(f"{blocks[i - 1].path}.y", b.path, "u") for i, b in enumerate(blocks)]
    return blocks, wires + [DrawnWire(f"{blocks[(7 * i) % count].path}.z", b.path, "v", "hold")
                            for i, b in enumerate(blocks) if i % 3]  # fmt: skip


def nest(count: int) -> Large:
    blocks = [
        block("/".join(["p"] * (i % 9)) + f"/b{i}" if i % 9 else f"b{i}", "u", "y") for i in range(count)
    ]
    return blocks, [DrawnWire(f"{blocks[i - 1].path}.y", b.path, "u") for i, b in enumerate(blocks)]


def delays(count: int) -> Large:
    blocks = [block(f"b{i}", "u", "y") for i in range(count)]
    return blocks, [DrawnWire(f"{b.path}.y", b.path, "u", "delay") for b in blocks]


def tangle(count: int) -> Large:
    blocks = [block(f"b{i}", "a b c", "x y") for i in range(count)]
    steps = {"a": 17, "b": 101, "c": 2}
    return blocks, [
        DrawnWire(f"b{(port_step * i + 5) % count}.{'xy'[i % 2]}", b.path, port)
        for i, b in enumerate(blocks) for port, port_step in steps.items()
    ]  # fmt: skip


def assert_large_is_well_drawn(svg: str, blocks: list[DrawnBlock], wires: list[DrawnWire]) -> Picture:
    """The promises of `assert_well_drawn`, on a grid, since pairs of thousands are too many."""
    picture = read(svg, texts=False)
    assert list(picture.boxes) == [block.path for block in blocks]
    assert len(picture.wires) == len(wires)
    size = Rectangle.of(picture.root)
    cells: dict[tuple[int, int], list[str]] = {}
    for path, box in picture.boxes.items():
        assert size.contains(box.outline)
        for cell in covered(box.outline):
            for other in cells.setdefault(cell, []):
                assert not box.outline.overlaps(picture.boxes[other].outline), (path, other)
            cells[cell].append(path)
        for part, frame in picture.parts.items():
            inside = path.startswith(f"{part}/")
            assert frame.contains(box.outline) if inside else not frame.overlaps(box.outline), (path, part)
    for wire in wires:
        assert_ends_at_its_ports(picture, wire)
    for ends, line in picture.wires.items():
        assert all(x == u or y == v for (x, y), (u, v) in itertools.pairwise(line)), ends
        for piece in segments(line):
            near = {path for cell in covered(piece) for path in cells.get(cell, ())}
            assert not any(passes(piece, picture.boxes[path].outline) for path in near), ends
    return picture


def covered(area: Rectangle, size: float = 250.0) -> list[tuple[int, int]]:
    across = range(int(area.left // size), int(area.right // size) + 1)
    along = range(int(area.top // size), int(area.bottom // size) + 1)
    return [(x, y) for x in across for y in along]


@pytest.mark.parametrize(
    ("make", "count"),
    mostly_slow([
        (chain, 252), (ring, 400), (apart, 251), (nest, 300), (delays, 300), (tangle, 300), (chain, 1000),
        (apart, 4000), (fan, 500), (funnel, 300), (tree, 600), (pairs, 700), (parts, 300),
    ], 6),
    ids=lambda value: getattr(value, "__name__", str(value)),
)  # fmt: skip
def test_a_large_diagram_is_well_drawn_without_the_engine(
    make: Callable[[int], Large], count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis.output.elkjs.layout", lambda graph: pytest.fail("it takes too long"))
    blocks, wires = make(count)
    picture = assert_large_is_well_drawn(draw(make.__name__, blocks, wires, {}, TASKS), blocks, wires)
    size = Rectangle.of(picture.root)
    if make not in (funnel, nest):  # one is as high as its one box
        assert 0.4 < size.right / size.bottom < 6.0


@pytest.mark.slow
def test_the_time_of_a_large_drawing_grows_with_it_and_no_faster() -> None:
    def cpu(count: int) -> float:
        blocks, wires = chain(count)
        before = time.process_time()
        draw("chain", blocks, wires, {}, TASKS)
        return time.process_time() - before

    cpu(300)
    assert cpu(3000) < 40 * max(cpu(300), cpu(300))


def test_importing_the_module_loads_no_engine() -> None:
    program = "import sys, quadvis.output.draw; print('quickjs' in sys.modules)"
    environment = {"PYTHONPATH": ":".join(sys.path)}
    answer = subprocess.run([sys.executable, "-c", program], capture_output=True, check=True, env=environment)
    assert answer.stdout.strip() == b"False"


def test_the_vendored_engine_is_the_file_that_its_readme_describes() -> None:
    folder = Path(quadvis.output.elkjs.__file__).parent
    digest = hashlib.sha256((folder / "elk-worker.min.js").read_bytes()).hexdigest()
    assert digest in (folder / "README.md").read_text("utf-8")
