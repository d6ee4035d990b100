"""From YAML to what a file says: keys known, texts read, places kept; nothing is looked up elsewhere."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from fractions import Fraction
from pathlib import Path

from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.times import Rate, read_duration, read_rate, read_step
from quadvis.diagram.values import QUANTITY_KEYS, read_constant
from quadvis.document import YamlMap, YamlNode, YamlScalar, parse_yaml, read_yaml
from quadvis.engine.graph import CROSSINGS, SOLVERS, TOLD
from quadvis.errors import Faults, Place, closest, quoted
from quadvis.errors.characters import cleaned, first_odd, replacement, with_article

VERSION = 1
CONTINUOUS = "continuous"
INSIDE = "in"  # the name under which a part's blocks see what comes in
NAME = re.compile(r"[A-Za-z_]\w{0,63}", re.ASCII)
PATH = re.compile(rf"{NAME.pattern}(?:/{NAME.pattern})*", re.ASCII)  # a resolved diagram has whole paths

REQUIRED_KEYS = ("quadvis", "name", "blocks")
DIAGRAM_KEYS = (
    "doc", "params", "rates", "solver", "stop_time", "seed", "files", "variants",
    "log", "expect", "summary", "figures", "analyse",
)  # fmt: skip
PART_KEYS = ("doc", "params", "ports")
BLOCK_KEYS = ("block", "part", "rate", "slot", "with", "in")
WIRE_KEYS = ("from", "across")
SOLVER_KEYS = ("method", "step")
PORT_KEYS = ("in", "out")
VARIANT_KEYS = ("doc", "base", "slots")
SECTIONS = ("log", "expect", "summary", "figures", "analyse")


@dataclass(frozen=True)
class InputSpec:
    """What an input is given: a signal or a constant, and how the wire crosses between rates."""

    place: Place
    source: Reference | YamlNode | None  # None: what is wrong has been told
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
    rate: tuple[str, Place] | None = None
    slot: Place | None = None
    parameters: dict[str, YamlNode] = field(default_factory=dict)
    parameter_places: dict[str, Place] = field(default_factory=dict)
    inputs: dict[str, InputSpec] | None = None  # None: no 'in' was written
    told: frozenset[str] = frozenset()  # keys that are wrong or misspelt: what they lack is no news


@dataclass
class FileSpec:
    """All that one file says. A part has ports; a diagram has rates, a solver and what to make of a run."""

    path: Path
    place: Place  # of the file as a whole
    top: Place  # where its keys begin
    name: str = ""
    params: dict[str, YamlNode | None] = field(default_factory=dict)  # None: what is wrong has been told
    blocks: dict[str, BlockSpec] = field(default_factory=dict)
    broken: set[str] = field(default_factory=set)  # entries under blocks that could not be read
    inputs: dict[str, Place] = field(default_factory=dict)  # of a part
    outputs: dict[str, Reference | None] = field(default_factory=dict)  # of a part
    rates: dict[str, Rate | None] = field(default_factory=dict)
    solver: str = "ode4"
    step: Fraction | None = None
    step_place: Place | None = None
    step_told: bool = False
    stop_time: Fraction | None = None
    seed: int = 0
    files: dict[str, YamlNode] = field(default_factory=dict)
    variants: dict[str, dict[str, BlockSpec | None]] = field(default_factory=dict)
    bases: dict[str, tuple[str, Place]] = field(default_factory=dict)  # the variant on which one builds
    sections: dict[str, YamlNode] = field(default_factory=dict)  # those about signals


def read_file(path: Path, faults: Faults, *, part: bool) -> FileSpec | None:
    """Read a diagram or a part; faults are collected, and None means that nothing could be read."""
    return _read(path, faults.collect(read_yaml, path, faults), faults, part)


def read_text(text: str, path: Path, faults: Faults) -> FileSpec | None:
    """Read the text of a diagram as if it stood in a file."""
    return _read(path, faults.collect(parse_yaml, text, str(path), faults), faults, part=False)


def _read(path: Path, node: YamlNode | None, faults: Faults, part: bool) -> FileSpec | None:
    root = faults.collect(node.mapping) if node is not None else None
    if root is None or not _is_ours(root, faults, part):
        return None
    spec = FileSpec(path, Place(str(path)), root.place, path.stem)
    root = root.fields(REQUIRED_KEYS, PART_KEYS if part else DIAGRAM_KEYS, faults)
    for key in ("name", "doc"):
        text = faults.collect(root[key].text) if key in root else None
        spec.name = text if text and key == "name" else spec.name
    for name, value in _named(root, "params", "parameter", faults):
        with faults.about(f"parameter '{name}'"):
            spec.params[name] = read_constant(value, faults)
    _read_blocks(spec, root, faults)
    if part:
        _read_ports(spec, root, faults)
    else:
        _read_time(spec, root, faults)
        _read_variants(spec, root, faults)
        spec.files = dict(_map(root.get("files"), faults))
        spec.sections = {key: root[key] for key in SECTIONS if key in root}
    return spec


def is_version(root: YamlMap, faults: Faults) -> bool:
    """Tell a file of another version in one sentence, not by all that is odd in it."""
    version = root.get("quadvis")
    if version is not None and faults.collect(version.integer) not in (VERSION, None):
        remedy = f"this quadvis reads version {VERSION}"
        faults.add(version.place, f"the file is of version {version.to_python()}", remedy)
        return False
    return True


def _is_ours(root: YamlMap, faults: Faults, part: bool) -> bool:
    """Tell a file of another version or of another kind in one sentence."""
    if not is_version(root, faults):
        return False
    if "set" in root and "blocks" not in root:
        problem = "this is a parameter file, since it has 'set'"
        faults.add(root.keys["set"].place, problem, "give the diagram, and this file with --params")
        return False
    if not part and "ports" in root:
        problem = "this is a part of a diagram, since it has 'ports'"
        faults.add(root.keys["ports"].place, problem, "give a diagram that names it as 'part: file.yaml'")
        return False
    if part and "ports" not in root and "rates" in root:
        problem = "this is a diagram, not a part, since it has 'rates'"
        faults.add(
            root.keys["rates"].place, problem, "give its blocks to a file with 'ports' to make it a part"
        )
        return False
    return True


def _map(node: YamlNode | None, faults: Faults) -> list[tuple[str, YamlNode]]:
    mapping = faults.collect(node.mapping) if node is not None else None
    return list(mapping.values.items()) if mapping is not None else []


def _named(root: YamlMap, key: str, what: str, faults: Faults) -> list[tuple[str, YamlNode]]:
    """Return the entries of a map from names; keys that are no names are told."""
    node = root.get(key)
    mapping = faults.collect(_with_clean_names, node, faults) if node is not None else None
    for name, written in mapping.keys.items() if mapping is not None else ():
        if NAME.fullmatch(name) is None:
            _refuse_name(written, what, faults)
    return list(mapping.values.items()) if mapping is not None else []


def _with_clean_names(node: YamlNode, faults: Faults) -> YamlMap:
    """Return a map of which the keys are names; those with odd characters are refused, and read as meant."""
    mapping = node.mapping()
    for key in list(mapping.keys.values()):
        char, name = first_odd(key.value), cleaned(key.value)
        if char is not None and PATH.fullmatch(name) and name not in mapping:
            problem = f"{quoted(key.value)} holds {with_article(char)}"
            faults.add(key.place, problem, replacement(char))
            mapping = mapping.renamed(key.value, name)
    return mapping


def _refuse_name(key: YamlScalar, what: str, faults: Faults) -> None:
    remedy = "use letters, digits and '_', and begin with a letter"
    faults.add(key.place, f"'{key.value}' cannot name a {what}", remedy)


def _read_blocks(spec: FileSpec, root: YamlMap, faults: Faults) -> None:
    node = root.get("blocks")
    mapping = faults.collect(_with_clean_names, node, faults) if node is not None else None
    if mapping is not None and not mapping.values:
        remedy = "add one, such as 'source: {block: sources.sine, rate: fast}'"
        faults.add(mapping.place, "there are no blocks", remedy)
    for name, value in mapping.values.items() if mapping is not None else ():
        assert mapping is not None
        key = mapping.keys[name]
        with faults.about(f"block '{name}'"):
            if name == INSIDE:
                faults.add(key.place, "no block can be called 'in'", "'in' names the inputs of a part")
            elif PATH.fullmatch(name) is None:
                _refuse_name(key, "block", faults)
            block = read_block(name, Place(key.file, key.line, key.column), value, faults)
        if block is None:
            spec.broken.add(name)
        else:
            spec.blocks[name] = block


def read_block(name: str, place: Place, node: YamlNode, faults: Faults) -> BlockSpec | None:
    """Read one entry under ``blocks`` or under a variant's ``slots``; None if it does not say what it is."""
    fields = faults.collect(node.fields, (), BLOCK_KEYS, faults)
    if fields is None:
        return None
    told = {closest(key, BLOCK_KEYS) or "" for key in fields if key not in BLOCK_KEYS}
    kinds = [fields[key] for key in ("block", "part") if key in fields]
    kind = faults.collect(kinds[0].text) if len(kinds) == 1 else None
    given = faults.collect(_with_clean_names, fields["with"], faults) if "with" in fields else None
    wired = faults.collect(_with_clean_names, fields["in"], faults) if "in" in fields else None
    inputs = {port: _read_input(value, faults) for port, value in (wired.values if wired else {}).items()}
    rate = faults.collect(fields["rate"].text) if "rate" in fields else None
    is_slot = faults.collect(fields["slot"].boolean) if "slot" in fields else False
    if len(kinds) != 1 and not told & {"block", "part"}:
        problem = "both 'block' and 'part' are given" if kinds else "neither 'block' nor 'part' is given"
        faults.add(place, problem, "give 'block: group.name' or 'part: file.yaml'")
    if kind is None:
        return None
    read = {"rate": rate, "with": given, "in": wired, "slot": is_slot}
    told |= {key for key, value in read.items() if key in fields and value is None}
    return BlockSpec(
        name,
        place,
        kind,
        kinds[0].place,
        is_part="part" in fields,
        rate=(rate, fields["rate"].place) if rate is not None else None,
        slot=fields["slot"].place if is_slot else None,
        parameters=given.values if given is not None else {},
        parameter_places={key: node.place for key, node in given.keys.items()} if given is not None else {},
        inputs=inputs if "in" in fields else None,
        told=frozenset(told),
    )


def _read_input(node: YamlNode, faults: Faults) -> InputSpec:
    """Read ``block.port``, ``{from: block.port, across: hold}``, ``1 m`` or ``{value: ..., unit: ...}``."""
    is_value = isinstance(node, YamlMap) and any(key in node for key in QUANTITY_KEYS)
    if isinstance(node, YamlMap) and is_value and "from" in node:
        faults.add(node.place, "a signal and a value are given at once", "keep 'from' or 'value'")
        return InputSpec(node.place, None)
    if isinstance(node, YamlMap) and not is_value:
        node = node.fields(WIRE_KEYS[:1], WIRE_KEYS[1:], faults)
        source = read_reference(node["from"], faults) if "from" in node else None
        across = node.get("across")
        crossing = faults.collect(across.choice, CROSSINGS) if across is not None else None
        if crossing is None and len(node) > 1:
            crossing = TOLD
        return InputSpec(node.place, source, crossing, across.place if across is not None else None)
    if isinstance(node, YamlScalar) and _is_reference(node.value):
        return InputSpec(node.place, read_reference(node, faults))
    return InputSpec(node.place, node)


def _is_reference(text: str) -> bool:
    """Say whether an input's text is meant as a signal: no number, truth value or ``$name``."""
    return (text[:1].isalpha() or text[:1] == "_") and text not in ("true", "false")


def _read_ports(spec: FileSpec, root: YamlMap, faults: Faults) -> None:
    node = root.get("ports")
    fields = faults.collect(node.fields, (), PORT_KEYS, faults) if node is not None else None
    if fields is None:
        return
    for item in (faults.collect(fields["in"].items) if "in" in fields else None) or []:
        name = faults.collect(item.name)
        if name is not None and name in spec.inputs:
            remedy = "keep one of them"
            faults.add(item.place, f"input '{name}' is already in line {spec.inputs[name].line}", remedy)
        elif name is not None:
            spec.inputs[name] = item.place
    for name, value in _named(fields, "out", "port", faults):
        spec.outputs[name] = read_reference(value, faults)


def _read_time(spec: FileSpec, root: YamlMap, faults: Faults) -> None:
    for name, value in _named(root, "rates", "rate", faults):
        spec.rates[name] = faults.collect(read_rate, value)
        if name == CONTINUOUS:
            remedy = "choose another name, or set 'solver: {step: ...}'"
            faults.add(value.place, "'continuous' is the rate of the solver", remedy)
    solver = root.get("solver")
    fields = faults.collect(solver.fields, (), SOLVER_KEYS, faults) if solver is not None else None
    if fields is not None and "method" in fields:
        spec.solver = faults.collect(fields["method"].choice, SOLVERS) or spec.solver
    if fields is not None and "step" in fields:
        spec.step_place = fields["step"].place
        spec.step = faults.collect(read_step, fields["step"])
    spec.step_told = solver is not None and (fields is None or ("step" in fields and spec.step is None))
    if "stop_time" in root:
        spec.stop_time = faults.collect(read_duration, root["stop_time"]) or Fraction(0)
    if "seed" in root:
        spec.seed = faults.collect(root["seed"].integer) or 0


def _read_variants(spec: FileSpec, root: YamlMap, faults: Faults) -> None:
    for variant, value in _named(root, "variants", "variant", faults):
        spec.variants[variant] = {}
        with faults.about(f"variant '{variant}'"):
            fields = faults.collect(value.fields, (), VARIANT_KEYS, faults)
            slots = fields.get("slots") if fields is not None else None
            mapping = faults.collect(slots.mapping) if slots is not None else None
            if fields is not None and "base" in fields:
                base = faults.collect(fields["base"].text)
                if base is not None:
                    spec.bases[variant] = base, fields["base"].place
        for key, entry in mapping.pairs() if mapping is not None else []:
            with faults.about(f"variant '{variant}', block '{key.value}'"):
                spec.variants[variant][key.value] = read_block(key.value, key.place, entry, faults)
