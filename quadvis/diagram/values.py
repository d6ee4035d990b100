"""Typed values out of a diagram's nodes: parameters, constants, and the units in which they were written."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from quadvis.block import Param, SignalType
from quadvis.diagram.matrices import FileNumbers
from quadvis.document import YamlList, YamlNode, YamlScalar
from quadvis.document.number_lists import Numbers
from quadvis.errors import Fault, Faults, Unknown, known, quoted
from quadvis.machine.shipped import named_file, named_output
from quadvis.units import Unit, parse_quantity, split_quantity


class Bare:
    """In place of a unit: a number other than 0 was written without one."""


BARE = Bare()
_INFINITE = re.compile(r"([+-]?)inf(?:\s+(.+))?")
OpenUnits = tuple[Unit | Bare | None, ...]  # of the elements; None is a 0 without unit, which fits any


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
    if param.is_map:
        return node.text() if isinstance(node, YamlScalar) else json.dumps(node.to_python()), ()
    if param.is_text:
        return node.text(), ()
    if param.choices:
        return node.choice(param.choices), ()
    return read_numbers(param, param.units, node)


def read_numbers(param: Param, units: Sequence[Unit], node: YamlNode) -> tuple[Any, OpenUnits]:
    """Return what `read_value` does; an infinite default may also be written as it is shown, "-inf m".

    So the values in force, which parameter sets keep, can all be given again.
    """
    infinite = _default_infinity(param, node)
    if infinite is None:
        return read_value(param.signal, units, node)
    if not infinite.value:
        return param.default, (None,) if any(unit.variables for unit in units) else ()
    return param.default, read_value(param.signal, units, infinite)[1]


def _default_infinity(param: Param, node: YamlNode) -> YamlScalar | None:
    """Return 1 with the unit of an infinite value, or "" if it has no unit; None if it is no such default."""
    if not isinstance(param.default, float) or not math.isinf(param.default):
        return None
    match = _INFINITE.fullmatch(node.value.strip()) if isinstance(node, YamlScalar) else None
    if match is None or (match[1] == "-") != (param.default < 0):
        return None
    one = f"1 {match[2]}" if match[2] else ""
    return YamlScalar(one, True, node.file, node.line, node.column, node.key)


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
    if isinstance(node, FileNumbers):
        node = node.of_rank(len(signal.shape))
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
