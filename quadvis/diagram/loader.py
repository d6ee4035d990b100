"""From YAML to the contents of one file: keys are known, texts read, places kept; no other file is read."""

from __future__ import annotations

from pathlib import Path

from quadvis.diagram.keys import FILE_SECTIONS, RUN_SECTIONS, keys
from quadvis.diagram.sections.base import BASE
from quadvis.diagram.sections.header import FORMAT, NAME, is_version
from quadvis.diagram.sections.section import DIAGRAM, GROUP, PART, Values
from quadvis.diagram.spec import FileSpec
from quadvis.document import YamlMap, YamlNode, parse_yaml, read_yaml
from quadvis.errors import UNKNOWN, Faults, Place, Unknown
from quadvis.errors.caller import as_given

GROUP_SECTIONS = [section for section in FILE_SECTIONS if GROUP in section.kinds]


def read_file(path: Path, faults: Faults) -> FileSpec | Unknown:
    """Read a diagram; faults are collected."""
    return _read(path, faults.collect(read_yaml, path, faults), faults, DIAGRAM)


def read_part(path: Path, faults: Faults) -> FileSpec | Unknown:
    """Read a part likewise."""
    return _read(path, faults.collect(read_yaml, path, faults), faults, PART)


def read_group(path: Path, faults: Faults) -> FileSpec | Unknown:
    """Read a group of parameters likewise."""
    return _read(path, faults.collect(read_yaml, path, faults), faults, GROUP)


def read_text(text: str, path: Path, faults: Faults) -> FileSpec | Unknown:
    """Read the text of a diagram as if it stood in a file."""
    return _read(path, faults.collect(parse_yaml, text, str(path), faults), faults, DIAGRAM)


def _read(path: Path, node: YamlNode | None, faults: Faults, kind: str) -> FileSpec | Unknown:
    root = faults.collect(node.mapping) if node is not None else None
    if root is None or not is_version(root, faults) or not _is_kind(root, faults, kind):
        return UNKNOWN
    fields = _fields(root, kind, faults)
    values = Values()
    for section in FILE_SECTIONS:
        values[section] = section.read(fields.get(section.key) if kind in section.kinds else None, faults)
    nodes = {section.key: fields[section.key] for section in RUN_SECTIONS if section.key in fields}
    return FileSpec(path, Place(str(path)), root.place, values, nodes, frozenset(fields))


def _fields(root: YamlMap, kind: str, faults: Faults) -> YamlMap:
    """Return the keys of a file; what a diagram must have may come from its base, except format and name."""
    required, optional = keys(kind, required=True), keys(kind, required=False)
    fields = root.fields((), (*required, *optional), faults)
    needed = (FORMAT.key, NAME.key) if BASE.key in fields else required
    return fields.fields(needed, tuple(fields), faults)


def _is_kind(root: YamlMap, faults: Faults, kind: str) -> bool:
    """Report a file of another kind in one sentence."""
    problem = remedy = ""
    if "set" in root and "blocks" not in root:
        key, problem = "set", "this is a parameter file, since it has 'set'"
        remedy = f"give the diagram, and this file with {as_given('--params', 'params')}"
    elif kind == GROUP and ("blocks" in root or "ports" in root):
        key = "blocks" if "blocks" in root else "ports"
        problem = f"this is a diagram or a part of one, not a group of parameters, since it has '{key}'"
        remedy = "give a file with 'params' and no blocks"
    elif kind != GROUP and "params" in root and {*root} <= {section.key for section in GROUP_SECTIONS}:
        key, problem = "params", "this is a group of parameters, since it has 'params' and no blocks"
        remedy = "give a diagram or a part that names it as 'params: {name: {group: file.yaml}}'"
    elif kind == DIAGRAM and "ports" in root:
        key, problem = "ports", "this is a part of a diagram, since it has 'ports'"
        remedy = "give a diagram that names it as 'part: file.yaml'"
    elif kind == PART and "ports" not in root and "rates" in root:
        key, problem = "rates", "this is a diagram, not a part, since it has 'rates'"
        remedy = "give its blocks to a file with 'ports' to make it a part"
    if problem:
        faults.add(root.keys[key].place, problem, remedy)
    return not problem
