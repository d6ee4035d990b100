"""The picture of a diagram: its blocks, wires and constants, handed to the drawing."""

from __future__ import annotations

from quadvis.diagram.diagram import Diagram
from quadvis.diagram.sections.block_text import constant_text
from quadvis.diagram.shown import main_parameters
from quadvis.diagram.times import rate_text
from quadvis.graph.graph import Constant, Node, Wire
from quadvis.graph.names import wire_text
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
    for path in diagram.listing:
        node = diagram.graph[path]
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
        blocks.append(drawn_block(node, tuple(shown)))
        for port in shown:
            source = node.inputs[port]
            if isinstance(source, Wire):
                wires.append(DrawnWire(wire_text(source), node.path, port, source.crossing))
            else:
                constants[node.path, port] = constant_text(node, port, source.value)
    tasks = {task.name: rate_text(task) for task in diagram.graph.tasks}
    return DrawnPicture(blocks, wires, constants, diagram.ports), tasks


def part_of(picture: DrawnPicture, part: str, depth: int | None) -> DrawnPicture:
    """Return a picture, or a part of it, with what lies deeper than ``depth`` as one box each."""
    picture = part_alone(picture, part) if part else picture
    return folded(picture, depth) if depth is not None else picture


def drawn_block(node: Node, inputs: tuple[str, ...]) -> DrawnBlock:
    """Return a block as it is drawn, with some of its inputs."""
    block = node.block
    lines = tuple(map(_short, block.picture_lines()[:MOST_LINES]))
    return DrawnBlock(
        node.path, node.kind, inputs, tuple(block.interface.outputs), node.task.name, lines,
        main_parameters(node), block.symbol, block.picture_formula(), block.picture_signs(),
    )  # fmt: skip


def _short(line: str) -> str:
    return line if len(line) <= LONGEST_LINE else f"{line[: LONGEST_LINE - 1]}…"


def _kind(link: Link) -> str:
    """Return what a link says of itself in its box."""
    speed = f", {link.baud} baud" if link.baud else ""
    return f"{link.source} to {link.target}: {link.via}{speed}"


def _is_drawn(node: Node, port: str) -> bool:
    source = node.inputs[port]
    return not isinstance(source, Constant) or source.value is not node.block.interface.inputs[port].default
