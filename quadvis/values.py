"""Typed values out of a diagram's nodes: parameters, constant inputs, and the units that they were written in."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from quadvis.block import Param, SignalType
from quadvis.document import Mapping, Node, Scalar, measure
from quadvis.document import Sequence as List
from quadvis.units import Unit, UnitError, parse_quantity, split_quantity

ONE = Unit()


def read_parameter(param: Param, node: Node) -> tuple[Any, tuple[Unit, ...]]:
    """Return a parameter's value as the block takes it, and its units where the declaration leaves them open.

    DiagramError if the value is of another kind, shape or unit.
    """
    if param.is_file:
        # A path is relative to the file that it stands in, wherever the diagram is run from.
        return str(Path(node.file).parent / node.text()), ()
    if param.is_text:
        return node.text(), ()
    if param.choices:
        return node.choice(param.choices), ()
    return read_value(param.signal, param.units, node)


def read_value(signal: SignalType, units: Sequence[Unit], node: Node) -> tuple[Any, tuple[Unit, ...]]:
    """Return a number, truth value or nested list in SI units, and the units of the elements if ``units`` has variables.

    A value is a quantity ("50 ms"), a list of them, or ``{value: [0, 1.5], unit: m}``. Numbers without a unit are
    refused where the declaration has one, except 0.
    """
    written: tuple[Unit, ...] = ()
    if isinstance(node, Mapping):
        fields = node.fields(("value",), ("unit",))
        written = fields["unit"].units() if "unit" in fields else ()
        node = fields["value"]
    if signal.scalar == "frame":
        raise node.wrong("a wire from a camera or a file")
    if signal.scalar != "float64" and not signal.shape:
        return (node.boolean() if signal.scalar == "bool" else node.integer()), ()
    shape = measure(node)
    if not signal.unify(shape, {}):
        wanted = " x ".join(map(str, signal.shape)) + " values" if signal.shape else "one value"
        found = " x ".join(map(str, shape)) + " values" if shape else "one value"
        raise node.fault(f"this takes {wanted}, not {found}")
    leaves = _leaves(node)
    values, found_units = [], []
    for index, leaf in enumerate(leaves):
        declared = units[index] if len(units) == len(leaves) else units[0]
        given = written[index if len(written) == len(leaves) else 0] if written else None
        value, unit = _number(leaf, declared, given)
        values.append(value)
        found_units.append(unit)
    open_units = tuple(found_units) if any(unit.variables for unit in units) else ()
    return _nested(node, iter(values)), open_units


def _number(node: Node, declared: Unit, given: Unit | None) -> tuple[float, Unit]:
    """Return one element in SI units, and its unit."""
    if given is not None and isinstance(node, Scalar) and not split_quantity(node.value)[1]:
        node = Scalar(f"{node.value} {given}" if given.symbols else node.value, False, node.file, node.line, node.column)
    if not declared.variables:
        return node.quantity(declared, bare=False), declared
    text = node.text()
    try:
        value, unit = parse_quantity(text)
    except UnitError as error:
        raise node.fault(error.problem, error.remedy) from None
    return value, si(unit)


def si(unit: Unit) -> Unit:
    """Return the SI unit of the same dimension."""
    return Unit.parse("*".join(f"{name}^({power})" for name, power in sorted(unit.dimension)) or "1")


def _leaves(node: Node) -> list[Node]:
    return [leaf for child in node for leaf in _leaves(child)] if isinstance(node, List) else [node]


def _nested(node: Node, values: Any) -> Any:
    return [_nested(child, values) for child in node] if isinstance(node, List) else next(values)
