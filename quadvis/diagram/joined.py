"""A block that does not always run as one box: with what says when it runs, and what shows its outputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from quadvis.block.symbol import BAR, GAIN, SUM
from quadvis.diagram.conditions import OUTPUT
from quadvis.output.drawn import DrawnBlock, DrawnWire
from quadvis.output.folding import DrawnPicture

Names = Mapping[tuple[str, str], str]


def joined(picture: DrawnPicture) -> DrawnPicture:
    """Return a picture in which the boxes that were added for single blocks are part of their boxes.

    Such a box has the path of the block before its own name, as the boxes in a part have that of the part.
    """
    boxes = {block.path: block for block in picture.blocks}
    owners = {
        block.path: owner
        for block in picture.blocks
        if (owner := block.path.rpartition("/")[0]) in boxes and (block.is_condition or block.kind == OUTPUT)
    }
    names = {
        (path, port): f"{port} of the condition" if port in boxes[owner].inputs else port
        for path, owner in owners.items()
        for port in boxes[path].inputs
    }
    for path, owner in owners.items():
        if boxes[path].is_condition:
            boxes[owner] = _with_condition(boxes[owner], boxes[path], names)
    wires = [_moved(wire, picture, owners, names) for wire in picture.wires if not _inside(wire, owners)]
    constants = {
        (owners.get(path, path), names.get((path, port), port)): text
        for (path, port), text in picture.constants.items()
        if path not in owners or boxes[path].is_condition
    }
    blocks = [boxes[block.path] for block in picture.blocks if block.path not in owners]
    return replace(picture, blocks=blocks, wires=wires, constants=constants)


def _with_condition(block: DrawnBlock, condition: DrawnBlock, names: Names) -> DrawnBlock:
    inputs = [names[condition.path, port] for port in condition.inputs]
    faulty = {names.get((condition.path, port), port): words for port, words in condition.faulty.items()}
    # Its wires lead to the box already, so the signals on which it depends need no lines.
    lines = [line for line in condition.lines if line.partition(":")[0] not in condition.inputs]
    plain = block.symbol in (SUM, GAIN, BAR) or bool(lines)  # whose forms have no room for it
    return replace(
        block, inputs=(*block.inputs, *inputs), lines=(*lines, *block.lines),
        symbol="" if plain else block.symbol, formula=() if plain else block.formula,
        faulty={**faulty, **block.faulty},
    )  # fmt: skip


def _inside(wire: DrawnWire, owners: Mapping[str, str]) -> bool:
    """Say whether a wire leads from a block, or from its condition, to what shows its outputs."""
    source, target = wire.source.rpartition(".")[0], wire.target_block
    return target in owners and owners[target] == owners.get(source, source)


def _moved(wire: DrawnWire, picture: DrawnPicture, owners: Mapping[str, str], names: Names) -> DrawnWire:
    """Return a wire from and to the boxes that are left."""
    signal, bracket, rest = wire.source.partition("[")
    path = signal.rpartition(".")[0]
    if path in owners:
        signal = next((each.source for each in picture.wires if each.target_block == path), signal)
    target = wire.target_block
    return replace(
        wire, source=signal + bracket + rest, target_block=owners.get(target, target),
        target_port=names.get((target, wire.target_port), wire.target_port),
    )  # fmt: skip
