"""The parameters of a diagram in values: ``$name``, ``$name[2]``, ``$group.name``, and arithmetic with them.

Values may also come from files: ``{file: gains.npz, name: K}``.
"""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Set

from quadvis.diagram.computed import computed, is_computed, names_in
from quadvis.diagram.group import Group
from quadvis.diagram.matrices import FILE, FILE_KEYS, read_matrix
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.document.number_lists import Numbers
from quadvis.errors import UNKNOWN, Faults, Unknown, known, quoted, suggestion
from quadvis.units import Unit, plain_text, split_quantity

QUANTITY_KEYS = ("value", "unit")
_PARAMETER = re.compile(
    r"\$(?P<name>[A-Za-z_]\w*)(?:\.(?P<entry>[A-Za-z_]\w*))?(?:\[(?P<element>\d{1,6})\])?", re.ASCII
)
_NO_NAMES: Set[str] = frozenset()
Params = Mapping[str, YamlNode | Unknown]


def read_constant(node: YamlNode, faults: Faults) -> YamlNode | Unknown:
    """Return a value with each unit at its number: ``{value: [1, 2], unit: m}`` becomes ``[1 m, 2 m]``.

    ``$name`` has no place in it.
    """
    return substitute(node, None, faults)


def substitute(node: YamlNode, params: Params | None, faults: Faults) -> YamlNode | Unknown:
    """Return a value likewise, with ``$name`` replaced by that parameter, and arithmetic by its value."""
    if isinstance(node, YamlScalar):
        if "$" not in node.value:
            return node
        if is_computed(node.value) and _PARAMETER.fullmatch(node.value) is None:
            return computed(node, lambda named: _parameter(named, params, faults), faults)
        return _parameter(node, params, faults) if node.value.startswith("$") else node
    if isinstance(node, Numbers):
        return node
    if isinstance(node, YamlList):
        found = [substitute(child, params, faults) for child in node]
        whole = [child for child in found if known(child)]
        if len(whole) < len(found):
            return UNKNOWN
        return YamlList(whole, node.file, node.line, node.column, node.key)
    assert isinstance(node, YamlMap)
    if FILE in node:
        unit = node.get("unit")
        value: YamlNode | Unknown = faults.read(
            read_matrix, node.fields(FILE_KEYS[:1], FILE_KEYS[1:], faults)
        )
        return faults.read(_spread, value, unit, node.key) if known(value) else UNKNOWN
    if not any(key in node for key in QUANTITY_KEYS):
        return _substituted_map(node, params, faults)
    node = node.fields(QUANTITY_KEYS[:1], QUANTITY_KEYS[1:], faults)
    value = substitute(node["value"], params, faults) if "value" in node else UNKNOWN
    return faults.read(_spread, value, node.get("unit"), node.key) if known(value) else UNKNOWN


def _substituted_map(node: YamlMap, params: Params | None, faults: Faults) -> YamlNode | Unknown:
    """Return a map of values, each with its parameters; its reader will report one that is no value."""
    if not named_parameters(node):
        return node
    values = {key: substitute(value, params, faults) for key, value in node.values.items()}
    whole = {key: value for key, value in values.items() if known(value)}
    if len(whole) < len(values):
        return UNKNOWN
    return YamlMap(node.keys, whole, node.file, node.line, node.column, node.key)


def _parameter(node: YamlScalar, params: Params | None, faults: Faults) -> YamlNode | Unknown:
    if params is None:
        faults.add(node.place, f"{quoted(node.value)} stands where a value must", "write the value itself")
        return UNKNOWN
    match = _PARAMETER.fullmatch(node.value)
    if match is None or match["name"] not in params:
        name = match["name"] if match else node.value[1:]
        remedy = suggestion(name, params) or "declare it under 'params'"
        faults.add(node.place, f"there is no parameter {quoted(name)} here", remedy)
        return UNKNOWN
    found = params[match["name"]]
    if known(found) and match["entry"] is not None:
        found = _entry(node, match, found, faults)
    if found is UNKNOWN or match["element"] is None:
        return found
    element = int(match["element"])
    if isinstance(found, YamlList) and element < len(found):
        return found[element]
    count = f"has {len(found)} elements" if isinstance(found, YamlList) else "is one value"
    name = match.group().partition("[")[0][1:]
    faults.add(node.place, f"parameter '{name}' {count}, there is no [{element}]", "count from 0")
    return UNKNOWN


def _entry(node: YamlScalar, match: re.Match[str], group: YamlNode, faults: Faults) -> YamlNode | Unknown:
    """Return the parameter of a group that ``$group.name`` means."""
    name, entry = match["name"], match["entry"]
    if not isinstance(group, Group):
        faults.add(node.place, f"parameter '{name}' is not a group", f"write '${name}'")
    elif entry not in group.entries:
        remedy = suggestion(entry, group.entries)
        faults.add(node.place, f"group '{name}' has no parameter '{entry}'", remedy)
    else:
        return group.take(entry)
    return UNKNOWN


def whole_parameter(node: YamlNode) -> str | None:
    """Return the parameter that a value is, ``$name`` or ``$group.name``; None if it is anything else."""
    match = _PARAMETER.fullmatch(node.value) if isinstance(node, YamlScalar) else None
    if match is None or match["element"] is not None:
        return None
    return match["name"] if match["entry"] is None else f"{match['name']}.{match['entry']}"


def named_parameters(node: YamlNode) -> Set[str]:
    """Return the names that a value takes from ``params``, also in arithmetic."""
    if type(node) is YamlScalar:  # most values are, so this is quick
        return names_in(node.value) if "$" in node.value else _NO_NAMES
    if isinstance(node, Numbers | Group):
        return _NO_NAMES
    if isinstance(node, YamlScalar):
        return names_in(node.value)
    children = node.values.values() if isinstance(node, YamlMap) else node.items()
    return {name for child in children for name in named_parameters(child)}


def _spread(value: YamlNode, unit: YamlNode | None, key: str) -> YamlNode:
    """Put a unit, or one for each element of the last axis, behind numbers without one; call it ``key``."""
    units = unit.units() if unit is not None else (Unit(),)
    if unit is not None:
        if any(each.variables for each in units):
            raise unit.fault(f"{quoted(unit.text())} is not a unit")
        shape = value.shape()
        if len(units) not in (1, *shape[-1:], math.prod(shape)):
            raise unit.fault(f"there are {len(units)} units for {shape[-1] if shape else 1} values")
    if isinstance(value, Numbers) and not value.element_units:
        return value.with_units(units if unit is not None else (), key)
    return _with_units(value, itertools.cycle(units), key)


def _with_units(node: YamlNode, units: Iterator[Unit], key: str) -> YamlNode:
    if isinstance(node, YamlList):
        values = [_with_units(child, units, f"{key}[{index}]") for index, child in enumerate(node)]
        return YamlList(values, node.file, node.line, node.column, key)
    unit = next(units)
    if not isinstance(node, YamlScalar):
        return node
    number, written = split_quantity(node.value)
    text = f"{number} {unit}" if number and not written and unit.symbols else plain_text(node.value)
    return YamlScalar(text, node.plain, node.file, node.line, node.column, key)
