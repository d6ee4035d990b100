"""From YAML to a plain description of what the file says: keys known, texts read, places kept, nothing looked up."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

from quadvis.document import Mapping, Node, Scalar, Sequence, read_yaml
from quadvis.errors import Faults, Place, suggestion
from quadvis.graph import CROSSINGS, SOLVERS, Index
from quadvis.units import Unit

VERSION = 1
CONTINUOUS = "continuous"
NAME = re.compile(r"[A-Za-z_]\w{0,63}(?:/[A-Za-z_]\w{0,63})*")
REFERENCE = re.compile(r"(?P<block>[A-Za-z_][\w/]*)\.(?P<port>[A-Za-z_]\w*)(?:\[(?P<index>[^\]]*)\])?")
SECOND = Unit.parse("s")

BLOCK_KEYS = ("block", "part", "rate", "slot", "with", "in")
DIAGRAM_KEYS = (
    "doc", "params", "rates", "solver", "stop_time", "seed", "blocks", "variants", "log", "expect", "summary", "figures",
)  # fmt: skip
PART_KEYS = ("doc", "params", "ports", "blocks")


@dataclass(frozen=True)
class Reference:
    """A signal as a file names it: ``vision/pose.position[1]``."""

    place: Place
    block: str
    port: str
    index: Index = ()

    @property
    def text(self) -> str:
        """The name without the index."""
        return f"{self.block}.{self.port}"


@dataclass(frozen=True)
class InputSpec:
    """What an input is given: a signal or a constant, and how the wire crosses between rates."""

    place: Place
    source: Reference | Node | None  # None: told to be wrong already
    across: str | None = None
    across_place: Place | None = None


@dataclass(frozen=True)
class BlockSpec:
    """One entry under ``blocks``: a block of the catalogue, or a part from a file."""

    name: str
    place: Place
    kind: str
    kind_place: Place
    is_part: bool
    rate: str | None = None
    rate_place: Place | None = None
    slot: bool = False
    parameters: dict[str, Node] = field(default_factory=dict)
    parameter_places: dict[str, Place] = field(default_factory=dict)
    inputs: dict[str, InputSpec] | None = None  # None: no 'in' was written


@dataclass(frozen=True)
class RateSpec:
    """A named rate: period and offset in seconds, exact."""

    place: Place
    period: Fraction
    offset: Fraction = Fraction(0)


@dataclass
class FileSpec:
    """Everything that one file says. A part has ports; a diagram has rates, a solver and what to do with a run."""

    path: Path
    name: str = ""
    doc: str = ""
    params: dict[str, Node] = field(default_factory=dict)
    blocks: dict[str, BlockSpec] = field(default_factory=dict)
    broken: set[str] = field(default_factory=set)  # entries under blocks that could not be read
    inputs: dict[str, Place] = field(default_factory=dict)  # of a part
    outputs: dict[str, Reference] = field(default_factory=dict)  # of a part
    rates: dict[str, RateSpec] = field(default_factory=dict)
    solver: str = "ode4"
    step: Fraction | None = None
    step_place: Place | None = None
    stop_time: Fraction | None = None
    seed: int = 0
    variants: dict[str, Mapping] = field(default_factory=dict)
    sections: dict[str, Node] = field(default_factory=dict)  # log, expect, summary, figures: about signals
    place: Place = field(default_factory=lambda: Place(""))


def read_file(path: Path, faults: Faults, *, part: bool) -> FileSpec | None:
    """Read a diagram or a part; faults are collected, and None means that nothing could be read."""
    spec = FileSpec(path, place=Place(str(path)))
    root = faults.collect(read_yaml, path, faults)
    root = faults.collect(root.mapping) if root is not None else None
    if root is None:
        return None
    version = root.get("quadvis")
    if version is not None and faults.collect(version.integer) not in (VERSION, None):
        faults.add(version.place, f"this file has version {version.to_python()}", f"this quadvis reads version {VERSION}")
        return None
    optional = PART_KEYS if part else DIAGRAM_KEYS
    faults.collect(root.fields, ("quadvis", "name", "blocks"), optional, faults)
    spec.name = _text(root, "name", faults) or path.stem
    spec.doc = _text(root, "doc", faults) or ""
    spec.params = dict(_pairs(root, "params", faults))
    _read_blocks(spec, root, faults)
    if part:
        _read_ports(spec, root, faults)
    else:
        _read_time(spec, root, faults)
        for key in ("log", "expect", "summary", "figures"):
            if key in root:
                spec.sections[key] = root[key]
    return spec


def _text(root: Mapping, key: str, faults: Faults) -> str | None:
    node = root.get(key)
    return None if node is None else faults.collect(node.text)


def _pairs(root: Mapping, key: str, faults: Faults) -> list[tuple[str, Node]]:
    node = root.get(key)
    mapping = faults.collect(node.mapping) if node is not None else None
    return list(mapping.values.items()) if mapping is not None else []


def _read_blocks(spec: FileSpec, root: Mapping, faults: Faults) -> None:
    node = root.get("blocks")
    mapping = faults.collect(node.mapping) if node is not None else None
    if mapping is None:
        return
    if not mapping.values:
        faults.add(mapping.place, "there are no blocks", "add one, such as 'source: {block: sources.sine, rate: fast}'")
    for key, value in mapping.pairs():
        with faults.about(f"block '{key.value}'"):
            if NAME.fullmatch(key.value) is None or key.value == "in":
                faults.add(key.place, f"'{key.value}' cannot name a block", "use letters, digits and '_', and not 'in'")
            block = read_block(key.value, key.place, value, faults)
        if block is None:
            spec.broken.add(key.value)
        else:
            spec.blocks[key.value] = block


def read_block(name: str, place: Place, node: Node, faults: Faults) -> BlockSpec | None:
    """Read one entry under ``blocks`` or under a variant's ``slots``."""
    fields = faults.collect(node.fields, (), BLOCK_KEYS, faults)
    if fields is None:
        return None
    kinds = [key for key in ("block", "part") if key in fields]
    if len(kinds) != 1:
        problem = "both 'block' and 'part' are given" if kinds else "neither 'block' nor 'part' is given"
        faults.add(place, problem, "give 'block: group.name' or 'part: file.yaml'")
        return None
    kind = faults.collect(fields[kinds[0]].text)
    if kind is None:
        return None
    rate = faults.collect(fields["rate"].text) if "rate" in fields else None
    slot = faults.collect(fields["slot"].boolean) if "slot" in fields else False
    parameters = fields.get("with")
    given = faults.collect(parameters.mapping) if parameters is not None else None
    inputs = fields.get("in")
    wired = faults.collect(inputs.mapping) if inputs is not None else None
    read = {}
    for key, value in wired.pairs() if wired is not None else []:
        read[key.value] = _read_input(value, faults) or InputSpec(value.place, None)
    return BlockSpec(
        name, place, kind, fields[kinds[0]].place, kinds[0] == "part", rate,
        fields["rate"].place if "rate" in fields else None, bool(slot),
        dict(given.values) if given is not None else {},
        {key.value: key.place for key, _ in given.pairs()} if given is not None else {},
        read if inputs is not None else None,
    )  # fmt: skip


def _read_input(node: Node, faults: Faults) -> InputSpec | None:
    """Read ``block.port``, ``{from: block.port, across: hold}``, a constant, or ``{value: ..., unit: ...}``."""
    if isinstance(node, Mapping) and "value" not in node:
        fields = faults.collect(node.fields, ("from",), ("across",), faults)
        source = read_reference(fields["from"], faults) if fields is not None and "from" in fields else None
        if fields is None or source is None:
            return None
        across = fields.get("across")
        crossing = faults.collect(across.choice, CROSSINGS) if across is not None else None
        return InputSpec(node.place, source, crossing, across.place if across is not None else None)
    if isinstance(node, Scalar) and not node.value.startswith("$") and node.value[:1].isalpha():
        if node.value in ("true", "false"):
            return InputSpec(node.place, node)
        source = read_reference(node, faults)
        return None if source is None else InputSpec(node.place, source)
    return InputSpec(node.place, node)


def read_reference(node: Node, faults: Faults) -> Reference | None:
    """Read the name of a signal, with an index if there is one."""
    text = faults.collect(node.text)
    if text is None:
        return None
    match = REFERENCE.fullmatch(text)
    index = _index(match["index"]) if match and match["index"] is not None else ()
    if match is None or index is None:
        faults.add(node.place, f"'{text}' is not a signal", "write block.port, block.port[0] or part/block.port[0:2]")
        return None
    return Reference(node.place, match["block"], match["port"], index)


def _index(text: str) -> Index | None:
    parts: list[int | slice] = []
    for part in text.split(","):
        bounds = re.fullmatch(r"\s*(\d{1,6})\s*(:\s*(\d{1,6})\s*)?", part)
        if bounds is None:
            return None
        parts.append(slice(int(bounds[1]), int(bounds[3])) if bounds[2] else int(bounds[1]))
    return tuple(parts)


def index_text(index: Index) -> str:
    """Return an index as a file writes it."""
    parts = [f"{part.start}:{part.stop}" if isinstance(part, slice) else str(part) for part in index]
    return f"[{','.join(parts)}]" if parts else ""


def _read_ports(spec: FileSpec, root: Mapping, faults: Faults) -> None:
    node = root.get("ports")
    fields = faults.collect(node.fields, (), ("in", "out"), faults) if node is not None else None
    if fields is None:
        return
    names = faults.collect(fields["in"].items) if "in" in fields else None
    for item in names or []:
        name = faults.collect(item.name)
        if name is not None:
            spec.inputs[name] = item.place
    for name, value in _pairs(fields, "out", faults):
        reference = read_reference(value, faults)
        if reference is not None:
            spec.outputs[name] = reference


def _read_time(spec: FileSpec, root: Mapping, faults: Faults) -> None:
    for name, value in _pairs(root, "rates", faults):
        rate = _read_rate(value, faults)
        if name == CONTINUOUS:
            faults.add(value.place, "'continuous' is the solver's rate", "choose another name, or set 'solver: {step: ...}'")
        elif rate is not None:
            spec.rates[name] = rate
    solver = root.get("solver")
    fields = faults.collect(solver.fields, (), ("method", "step"), faults) if solver is not None else None
    if fields is not None:
        if "method" in fields:
            spec.solver = faults.collect(fields["method"].choice, SOLVERS) or spec.solver
        if "step" in fields:
            spec.step = faults.collect(fields["step"].period)
            spec.step_place = fields["step"].place
    if "stop_time" in root:
        spec.stop_time = read_duration(root["stop_time"], faults)
    if "seed" in root:
        spec.seed = faults.collect(root["seed"].integer) or 0
    for name, value in _pairs(root, "variants", faults):
        variant = faults.collect(value.fields, (), ("doc", "slots"), faults)
        if variant is not None:
            spec.variants[name] = variant


def read_duration(node: Node, faults: Faults) -> Fraction | None:
    """Read a time that is not negative."""
    value = faults.collect(node.exact, SECOND)
    if value is not None and value < 0:
        faults.add(node.place, "a time cannot be negative", "write one such as '20 s'")
        return None
    return value


def _read_rate(node: Node, faults: Faults) -> RateSpec | None:
    if not isinstance(node, Mapping):
        period = faults.collect(node.period)
        return None if period is None else RateSpec(node.place, period)
    fields = faults.collect(node.fields, ("rate",), ("offset",), faults)
    period = faults.collect(fields["rate"].period) if fields is not None and "rate" in fields else None
    offset = read_duration(fields["offset"], faults) if fields is not None and "offset" in fields else Fraction(0)
    return None if period is None or offset is None else RateSpec(node.place, period, offset)


def substitute(node: Node, params: dict[str, Node], faults: Faults) -> Node | None:
    """Return the node with every ``$name`` or ``$name[i]`` replaced by the parameter that it names."""
    if isinstance(node, Scalar) and node.plain and node.value.startswith("$"):
        return _parameter(node, params, faults)
    if isinstance(node, Sequence):
        children = [substitute(child, params, faults) for child in node.values]
        whole = [child for child in children if child is not None]
        return Sequence(whole, node.file, node.line, node.column, node.key) if len(whole) == len(children) else None
    return node


def _parameter(node: Scalar, params: dict[str, Node], faults: Faults) -> Node | None:
    match = re.fullmatch(r"\$(\w+)(?:\[(\d{1,6})\])?", node.value)
    if match is None or match[1] not in params:
        name = match[1] if match else node.value[1:]
        remedy = suggestion(name, params) or "declare it under 'params'"
        faults.add(node.place, f"there is no parameter '{name}' here", remedy)
        return None
    found = params[match[1]]
    if match[2] is None:
        return found
    values = found["value"] if isinstance(found, Mapping) and "value" in found else found
    if not isinstance(values, Sequence) or int(match[2]) >= len(values):
        faults.add(node.place, f"parameter '{match[1]}' has no element {match[2]}", "count from 0")
        return None
    element = values[int(match[2])]
    units = found.get("unit") if isinstance(found, Mapping) else None
    if isinstance(units, Scalar) and isinstance(element, Scalar):
        each = units.value.split()
        unit = each[min(int(match[2]), len(each) - 1)] if each else ""
        return Scalar(f"{element.value} {unit}", False, element.file, element.line, element.column, element.key)
    return element
