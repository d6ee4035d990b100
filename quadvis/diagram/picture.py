"""The picture of a diagram: its blocks, wires and constants, handed to the drawing."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType

from quadvis.diagram.conditions import OUTPUT
from quadvis.diagram.diagram import Diagram
from quadvis.diagram.joined import joined
from quadvis.diagram.named_conditions import CONDITION
from quadvis.diagram.sections.block_text import constant_text
from quadvis.diagram.shown import main_parameters
from quadvis.diagram.times import rate_text
from quadvis.graph.graph import Constant, Node, Wire
from quadvis.graph.names import index_text, wire_text
from quadvis.links.link import Link
from quadvis.links.twin import ReceiverTwin
from quadvis.output.draw import draw
from quadvis.output.drawn import DrawnBlock, DrawnWire
from quadvis.output.folding import DrawnPicture, folded, part_alone

MOST_LINES, LONGEST_LINE = 24, 60  # at the foot of a box


def draw_diagram(diagram: Diagram, *, part: str = "", depth: int | None = None) -> str:
    """Return a picture of a diagram, or of one of its parts, as SVG.

    With ``depth`` what lies deeper is drawn as one box each: with 1 the parts of the diagram itself.
    QuadvisError if there is no such part.
    """
    picture, tasks = picture_of(diagram)
    picture = part_of(picture, part, depth)
    title = f"{diagram.name}: {part}" if part else diagram.name
    return draw(title, picture.blocks, picture.wires, picture.constants, tasks)


def picture_of(diagram: Diagram) -> tuple[DrawnPicture, dict[str, str]]:
    """Return all that is drawn of a diagram, and the words of the legend by task."""
    blocks, wires, constants = [], [], {}
    passed = _passed(diagram)
    for path in diagram.listing:
        node = diagram.graph[path]
        if path in passed:
            continue
        twin = node.block
        if isinstance(twin, ReceiverTwin):
            # Its sender is left out: a link takes the signals and gives them on the other side.
            signals = twin.link.message.signals
            names, kind = tuple(signal.name for signal in signals), _kind(twin.link)
            blocks.append(DrawnBlock(path, kind, names, tuple(twin.interface.outputs), node.task.name))
            wires += [DrawnWire(signal.source, path, signal.name) for signal in signals]
            continue
        interface = node.block.interface
        shown = [port for port in interface.inputs if _is_drawn(node, port)]
        blocks.append(drawn_block(node, tuple(shown), passed))
        for port in shown:
            source = node.inputs[port]
            if isinstance(source, Wire):
                wires.append(DrawnWire(_text(source, passed), node.path, port, source.crossing))
            else:
                constants[node.path, port] = constant_text(node, port, source.value)
    tasks = {task.name: rate_text(task) for task in diagram.graph.tasks}
    shown_by = {f"{path}.y": source for path, source in passed.items()}
    ports = {name: shown_by.get(signal, signal) for name, signal in diagram.ports.items()}
    return joined(DrawnPicture(blocks, wires, constants, ports)), tasks


def part_of(picture: DrawnPicture, part: str, depth: int | None) -> DrawnPicture:
    """Return a picture, or a part of it, with what lies deeper than ``depth`` as one box each."""
    picture = part_alone(picture, part) if part else picture
    return folded(picture, depth) if depth is not None else picture


def drawn_block(
    node: Node, inputs: tuple[str, ...], passed: Mapping[str, str] = MappingProxyType({})
) -> DrawnBlock:
    """Return a block as it is drawn, with some of its inputs; blocks that are ``passed`` are not drawn."""
    block, is_condition = node.block, node.kind == CONDITION
    own = (*_condition_lines(node, passed), *block.picture_lines())
    outputs = () if is_condition else tuple(block.interface.outputs)
    return DrawnBlock(
        node.path, node.kind, inputs, outputs, node.task.name, tuple(map(_short, own[:MOST_LINES])),
        main_parameters(node), block.symbol, block.picture_formula(), block.picture_signs(), is_condition,
    )  # fmt: skip


def _short(line: str) -> str:
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 1]}…"


def _kind(link: Link) -> str:
    """Return what a link says of itself in its box."""
    speed = f", {link.baud} baud" if link.baud else ""
    return f"{link.source} to {link.target}: {link.via}{speed}"


def _passed(diagram: Diagram) -> dict[str, str]:
    """Return the blocks that show outputs of parts, which are not drawn, and the signals that they show."""
    found: dict[str, str] = {}
    for node in diagram.graph.nodes:
        source = node.inputs.get("u")
        if node.kind == OUTPUT and isinstance(source, Wire) and not source.index:
            found[node.path] = _text(source, found)
    return found


def _text(wire: Wire, passed: Mapping[str, str]) -> str:
    """Return where a wire comes from, past the blocks that are not drawn."""
    inner = passed.get(wire.block)
    return wire_text(wire) if inner is None else inner + index_text(wire.index)


def _condition_lines(node: Node, passed: Mapping[str, str]) -> Iterator[str]:
    """Yield the signals on which a condition depends."""
    for port in ("when", "trigger", "reset") if node.kind == CONDITION else ():
        source = node.inputs.get(port)  # not there if it is faulty
        if isinstance(source, Wire):
            yield f"{port}: {_text(source, passed)}"


def _is_drawn(node: Node, port: str) -> bool:
    if node.kind == CONDITION and port.startswith("around_"):
        return False
    source = node.inputs[port]
    return not isinstance(source, Constant) or source.value is not node.block.interface.inputs[port].default
