"""Typed values out of a diagram's nodes: parameters, constants, and the units in which they were written."""

from __future__ import annotations

import itertools
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from quadvis.block import Param, SignalType
from quadvis.diagram.group import Group
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.document.number_lists import Numbers
from quadvis.errors import UNKNOWN, Fault, Faults, Unknown, known, quoted, suggestion
from quadvis.machine.shipped import named_file, named_output
from quadvis.units import Unit, parse_quantity, split_quantity

QUANTITY_KEYS = ("value", "unit")
_PARAMETER = re.compile(
    r"\$(?P<name>[A-Za-z_]\w*)(?:\.(?P<entry>[A-Za-z_]\w*))?(?:\[(?P<element>\d{1,6})\])?", re.ASCII
)


class Bare:
    """In place of a unit: a number other than 0 was written without one."""


BARE = Bare()
OpenUnits = tuple[Unit | Bare | None, ...]  # of the elements; None is a 0 without unit, which fits any


def read_constant(node: YamlNode, faults: Faults) -> YamlNode | Unknown:
    """Return a value with each unit at its number: ``{value: [1, 2], unit: m}`` becomes ``[1 m, 2 m]``.

    ``$name`` has no place in it.
    """
    return substitute(node, None, faults)


def substitute(
    node: YamlNode, params: Mapping[str, YamlNode | Unknown] | None, faults: Faults
) -> YamlNode | Unknown:
    """Return a value likewise, with ``$name`` and ``$name[i]`` replaced by the parameter that they name."""
    if isinstance(node, YamlScalar):
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
    if not any(key in node for key in QUANTITY_KEYS):
        return node  # no value at all: its reader will report this
    node = node.fields(QUANTITY_KEYS[:1], QUANTITY_KEYS[1:], faults)
    value = substitute(node["value"], params, faults) if "value" in node else UNKNOWN
    return faults.read(_spread, value, node.get("unit"), node.key) if known(value) else UNKNOWN


def _parameter(
    node: YamlScalar, params: Mapping[str, YamlNode | Unknown] | None, faults: Faults
) -> YamlNode | Unknown:
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


def named_parameters(node: YamlNode) -> set[str]:
    """Return the names that a value takes from ``params``: ``$name`` and ``$name[i]``."""
    if isinstance(node, YamlScalar):
        match = _PARAMETER.fullmatch(node.value)
        return {match["name"]} if match else set()
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
    text = f"{number} {unit}" if number and not written and unit.symbols else node.value
    return YamlScalar(text, node.plain, node.file, node.line, node.column, key)


def read_parameter(param: Param, node: YamlNode, diagram: Path | None = None) -> tuple[Any, OpenUnits]:
    """Return a parameter's value as the block takes it, and its units where the declaration leaves them open.

    ``diagram`` is the file that is loaded. DiagramError if the value is of another kind, shape or unit.
    """
    if param.is_file:
        # Relative to the file in which it stands, wherever the diagram is run from; none stays none.
        text = node.text()
        if param.writes and diagram is not None and text:
            return str(named_output(text, node.file, diagram)), ()
        return (str(named_file(text, node.file)) if text else ""), ()
    if param.is_text:
        return node.text(), ()
    if param.choices:
        return node.choice(param.choices), ()
    return read_value(param.signal, param.units, node)


def file_fault(
    fault: Fault, nodes: Mapping[str, YamlNode | Unknown], values: Mapping[str, Any], subject: str
) -> Fault:
    """Return a fault of a file that a parameter of a block names, with the block as its subject.

    ``nodes`` are the parameters as they are written, ``values`` what was read of them. A fault of the whole
    file is put where it is named.
    """
    named = [nodes[name] for name, value in values.items() if value == fault.place.file]
    found = next((node for node in named if known(node)), None)
    if found is not None and not fault.place.line:
        return Fault(found.place, subject, f"'{found.text()}': {fault.problem}", fault.remedy)
    subject = f"{subject}, {fault.subject}" if fault.subject else subject
    return Fault(fault.place, subject, fault.problem, fault.remedy)


def read_value(signal: SignalType, units: Sequence[Unit], node: YamlNode) -> tuple[Any, OpenUnits]:
    """Return a number, truth value or nested list in the declared unit, and the units if they are open.

    Numbers without a unit are refused where the declaration has one, except 0. All faults of the elements are
    raised together.
    """
    if signal.scalar == "frame":
        raise node.wrong("a wire from a camera or a file")
    shape = node.shape()
    if not signal.unify(shape, {}):
        label = quoted(node.key) if node.key else "this"
        raise node.fault(f"{label} takes {shape_text(signal.shape)}, not {shape_text(shape)}")
    if isinstance(node, Numbers) and _is_read_whole(signal, units, node):
        return _read_whole(units[0], node)
    faults = Faults()
    leaves = _leaves(node)
    read = [
        faults.collect(_element, signal.scalar, units[i % len(units)], leaf) for i, leaf in enumerate(leaves)
    ]
    faults.check()
    found = [pair for pair in read if pair is not None]
    is_open = any(unit.variables for unit in units)
    return _plain(node, iter(value for value, _ in found)), tuple(
        unit for _, unit in found
    ) if is_open else ()


def _is_read_whole(signal: SignalType, units: Sequence[Unit], node: Numbers) -> bool:
    """Say whether no element needs a look of its own: plain numbers where plain numbers belong."""
    plain = not any(unit.symbols for unit in node.element_units)
    free = len(units) == 1 and not any(
        unit.dimension - {(name, 1) for name in unit.variables} for unit in units
    )
    return plain and free and signal.scalar == "float64"


def _read_whole(declared: Unit, node: Numbers) -> tuple[Any, OpenUnits]:
    """Read a long list of plain numbers as if element by element."""
    if not declared.variables:
        return _floats(node.numbers), ()
    # All numbers but 0 are alike: a rule for one of them holds for the others.
    unit = _element("float64", declared, YamlScalar("1", True, node.file, node.line, node.column, node.key))[
        1
    ]
    return _floats(node.numbers), tuple([unit if number else None for number in node.flat()])


def _floats(numbers: list[Any]) -> list[Any]:
    if isinstance(numbers[0], list):
        return [_floats(each) for each in numbers]
    return [float(number) for number in numbers]


def shape_text(shape: Sequence[int | str]) -> str:
    """Return a shape in words."""
    if tuple(shape) == (1,):
        return "a list of one value"
    return f"{' x '.join(map(str, shape))} values" if shape else "one value"


def _element(scalar: str, declared: Unit, node: YamlNode) -> tuple[Any, Unit | Bare | None]:
    if scalar == "bool":
        return node.boolean(), None
    if scalar == "int64":
        return node.integer(), None
    if not declared.variables:
        return node.quantity(declared, bare=False), declared
    if not isinstance(node, YamlScalar) or not node.value:
        raise node.wrong("a number or a quantity")
    value, unit = node.read(parse_quantity)
    if unit.variables:
        label = f"{quoted(node.key)}: " if node.key else ""
        raise node.fault(f"{label}{quoted(unit)} is not a unit")
    if split_quantity(node.value)[1]:
        return value, si(unit)
    return value, BARE if value else None


def si(unit: Unit) -> Unit:
    """Return the SI unit of the same dimension: m for cm."""
    if unit.scale == 1.0:
        return unit
    return Unit.parse("*".join(f"{name}^({power})" for name, power in sorted(unit.dimension)) or "1")


def _leaves(node: YamlNode) -> list[YamlNode]:
    return [leaf for child in node for leaf in _leaves(child)] if isinstance(node, YamlList) else [node]


def _plain(node: YamlNode, values: Iterator[Any]) -> Any:
    return [_plain(child, values) for child in node] if isinstance(node, YamlList) else next(values)
