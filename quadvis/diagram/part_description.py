"""What a part takes and gives, as text: `quadvis describe FILE.yaml`."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from quadvis.diagram.loader import read_part
from quadvis.diagram.reference import Reference
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.header import DOC
from quadvis.diagram.sections.inputs import InputSpec
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.spec import FileSpec
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.errors import Faults, Unknown, known
from quadvis.library.describe import keyed
from quadvis.machine.columns import table
from quadvis.machine.shipped import named_file

TOP = "#"


def part_facts(name: str) -> dict[str, Any]:
    """Return the ports, parameters and blocks of the part in a file as plain data; DiagramError as below."""
    part = _read(name)
    return {
        "part": name,
        "doc": "\n".join(_words(part)),
        "inputs": {port: {"optional": port in part[PORTS].defaults} for port in part[PORTS].inputs},
        "outputs": {port: _source(source) for port, source in part[PORTS].outputs.items()},
        "params": {param: _text(value) for param, value in part[PARAMS].items()},
        "blocks": {block.name: block.kind for block in _blocks(part)},
    }


def part_description(name: str, width: int | None = None) -> str:
    """Return what the part in a file does, its ports, parameters and blocks, and an entry to copy.

    DiagramError lists the faults of the file.
    """
    part = _read(name)
    lines = [name, "", *_words(part), ""]
    for title, rows in (
        ("inputs", _inputs(part)),
        ("outputs", [(port, f"from {_source(source)}") for port, source in part[PORTS].outputs.items()]),
        ("parameters", [(param, f"= {_text(value)}") for param, value in part[PARAMS].items()]),
        ("blocks", [(block.name, f"{block.kind}{_runs(block)}") for block in _blocks(part)]),
    ):
        if rows:
            lines += [title, *(f"  {line}" for line in table(rows, width and width - 2)), ""]
    return "\n".join([*lines, "in a diagram", *(f"  {line}" for line in _entry(name, part))])


def _read(name: str) -> FileSpec:
    faults = Faults()
    part = read_part(named_file(name), faults)
    faults.check()
    assert known(part)
    return part


def _blocks(part: FileSpec) -> list[BlockSpec]:
    return [block for block in part[BLOCKS].values() if known(block)]


def _words(part: FileSpec) -> list[str]:
    """Return what the file says about itself: its `doc`, or the comment at its top."""
    if part[DOC]:
        return [part[DOC]]
    comment = []
    for line in part.path.read_text(encoding="utf-8").splitlines():
        if not line.startswith(TOP):
            break
        comment.append(line.removeprefix(TOP).strip())
    return comment


def _inputs(part: FileSpec) -> list[tuple[str, str]]:
    ports = part[PORTS]
    return [
        (port, f"optional, {_text(ports.defaults[port].source)}" if port in ports.defaults else "")
        for port in ports.inputs
    ]


def _runs(block: BlockSpec) -> str:
    """Return when a part or a block in the part runs, if not always."""
    runs = block.runs
    if runs is None or not known(runs):
        return ""
    found = [f"when {_signal(runs.when)}"] if runs.when is not None else []
    edges = ("triggered", runs.triggered), ("reset", runs.reset)
    found += [f"{word} {each.edge} {_signal(each.signal)}" for word, each in edges if each is not None]
    return "".join(f", {words}" for words in found)


def _signal(given: InputSpec) -> str:
    return _source(given.source) if isinstance(given.source, Reference) else _text(given.source)


def _source(reference: Any) -> str:
    return f"{reference.block}.{reference.port}" if known(reference) else ""


def _text(value: YamlNode | Unknown | Any) -> str:
    """Return a value as a diagram would have it."""
    if isinstance(value, YamlMap):
        return f"{{{_listed(f'{key.text()}: {_text(node)}' for key, node in value.pairs())}}}"
    if isinstance(value, YamlList):
        return f"[{_listed(map(_text, value.values))}]"
    return str(value.value) if isinstance(value, YamlScalar) else "..."


def _listed(texts: Iterable[str]) -> str:
    return ", ".join(texts)


def _entry(name: str, part: FileSpec) -> list[str]:
    """Return an entry under `blocks` that uses the part."""
    ports = part[PORTS]
    wires = [f"{port}: block.port" for port in ports.inputs if port not in ports.defaults]
    return [f"{part.name}:", f"  part: {name}", *keyed("in", wires)]
