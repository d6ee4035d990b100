"""A part of a picture by itself, and pictures whose deep parts are one box each."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from quadvis.errors import QuadvisError, counted, quoted, suggestion
from quadvis.output.drawn import DrawnBlock, DrawnWire, last

INSIDE, OUTSIDE = "in", "out"  # what stands for the surroundings of a part; no block of a part is called so


@dataclass(frozen=True)
class DrawnPicture:
    """All that is drawn: boxes, wires, and constants at inputs by block and port.

    ``ports`` are the ports of parts, "control.torque", and the signals of blocks that they are.
    """

    blocks: Sequence[DrawnBlock]
    wires: Sequence[DrawnWire]
    constants: Mapping[tuple[str, str], str]
    ports: Mapping[str, str]

    def given(self, part: str) -> dict[str, str]:
        """Return the names of the outputs of a part by the signals of blocks that they are."""
        return {
            source: name.removeprefix(f"{part}.")
            for name, source in self.ports.items()
            if name.rpartition(".")[0] == part
        }


class _PortNames:
    """Names for the ports of a box that stand for signals: short, and each once."""

    def __init__(self, known: Mapping[str, str]) -> None:
        self._known = known
        self.names: dict[str, str] = {}  # by signal

    def name(self, signal: str) -> str:
        """Return the name of a signal's port."""
        if signal not in self.names:
            block, _, port = signal.rpartition(".")
            choices = [self._known.get(signal, port), f"{last(block)} {port}", f"{block} {port}"]
            taken = {*self.names.values()}
            self.names[signal] = next((each for each in choices if each not in taken), choices[-1])
        return self.names[signal]

    @property
    def ports(self) -> tuple[str, ...]:
        """All names, in the order in which they were asked for."""
        return tuple(self.names.values())


def part_alone(picture: DrawnPicture, part: str) -> DrawnPicture:
    """Return the inside of a part; two boxes stand for its surroundings, with what comes in and goes out.

    QuadvisError if there is no such part.
    """
    known = parts_of(picture.blocks)
    if part not in known:
        remedy = suggestion(part, known) or "it has no parts"
        raise QuadvisError(f"the diagram has no part {quoted(part)}; {remedy}")
    front = f"{part}/"
    comes, goes = _PortNames({}), _PortNames(picture.given(part))
    wires = []
    for wire in picture.wires:
        starts, ends = wire.source.startswith(front), wire.target_block.startswith(front)
        if ends:
            signal, elements = _split(wire.source)
            outer = f"{INSIDE}.{comes.name(signal)}{elements}" if not starts else ""
            source = outer or wire.source.removeprefix(front)
            wires.append(replace(wire, source=source, target_block=wire.target_block.removeprefix(front)))
        elif starts:
            signal, _ = _split(wire.source)
            if signal not in goes.names:
                wires.append(DrawnWire(signal.removeprefix(front), OUTSIDE, goes.name(signal)))
    inside = [each for each in picture.blocks if each.path.startswith(front)]
    blocks = [replace(each, path=each.path.removeprefix(front)) for each in inside]
    if comes.ports:
        blocks.insert(0, DrawnBlock(INSIDE, "what comes in", (), comes.ports, blocks[0].task))
    if goes.ports:
        blocks.append(DrawnBlock(OUTSIDE, "what goes out", goes.ports, (), blocks[-1].task))
    constants = {
        (path.removeprefix(front), port): text
        for (path, port), text in picture.constants.items()
        if path.startswith(front)
    }
    ports = {
        name.removeprefix(front): source.removeprefix(front)
        for name, source in picture.ports.items()
        if name.startswith(front)
    }
    return DrawnPicture(blocks, wires, constants, ports)


def folded(picture: DrawnPicture, depth: int) -> DrawnPicture:
    """Return a picture in which all below a depth is one box: with 1, each part of the diagram itself."""
    boxes: dict[str, list[DrawnBlock]] = {}
    for block in picture.blocks:
        boxes.setdefault(_box(block.path, depth), []).append(block)
    folds = {path for path, inside in boxes.items() if inside[0].path != path}
    comes = {path: _PortNames({}) for path in folds}
    goes = {path: _PortNames(picture.given(path)) for path in folds}
    wires: dict[DrawnWire, None] = {}
    for wire in picture.wires:
        signal, elements = _split(wire.source)
        home, away = _box(signal.rpartition(".")[0], depth), _box(wire.target_block, depth)
        if home == away and home in folds:
            continue
        source = f"{home}.{goes[home].name(signal)}" if home in folds else signal
        if away in folds:
            wires[DrawnWire(source, away, comes[away].name(signal))] = None
        else:
            wires[replace(wire, source=source + elements)] = None
    blocks = [
        _fold(path, inside, comes[path].ports, goes[path].ports) if path in folds else inside[0]
        for path, inside in boxes.items()
    ]
    constants = {at: text for at, text in picture.constants.items() if _box(at[0], depth) not in folds}
    return DrawnPicture(blocks, list(wires), constants, picture.ports)


def shortened(picture: DrawnPicture) -> DrawnPicture:
    """Return a picture whose boxes have no outputs that lead nowhere; each says how many it leaves out."""
    used = {_split(wire.source)[0] for wire in picture.wires} | {*picture.ports.values()}
    blocks = []
    for block in picture.blocks:
        wired = tuple(port for port in block.outputs if f"{block.path}.{port}" in used)
        count = len(block.outputs) - len(wired)
        if count > 1 and not block.symbol:
            lines = (*block.lines, f"and {counted(count, 'more output')}")
            block = replace(block, outputs=wired, lines=lines)
        blocks.append(block)
    return replace(picture, blocks=blocks)


def _fold(
    path: str, inside: Sequence[DrawnBlock], inputs: tuple[str, ...], outputs: tuple[str, ...]
) -> DrawnBlock:
    """Return the box of a part, with its condition; its colour is that of the task of most of its blocks."""
    task = Counter(block.task for block in inside).most_common(1)[0][0]
    own = [block for block in inside if block.is_condition and block.path.rpartition("/")[0] == path]
    lines = dict.fromkeys(line for block in own for line in block.lines)  # one condition for each rate
    faults = [words for block in inside for words in block.faulty.values()]
    kind = f"a part of {counted(len([each for each in inside if not each.is_condition]), 'block')}"
    return DrawnBlock(
        path, kind, inputs, outputs, task, tuple(lines), faulty={"": "; ".join(faults)} if faults else {}
    )


def parts_of(blocks: Sequence[DrawnBlock]) -> list[str]:
    """Return the paths of all parts, outer ones first."""
    found: dict[str, None] = {}
    for block in blocks:
        names = block.path.split("/")
        found.update(dict.fromkeys("/".join(names[:count]) for count in range(1, len(names))))
    return list(found)


def _box(path: str, depth: int) -> str:
    return "/".join(path.split("/")[:depth])


def _split(source: str) -> tuple[str, str]:
    """Return the signal at which a wire starts, and the elements that it takes, as text."""
    signal, bracket, rest = source.partition("[")
    return signal, bracket + rest
