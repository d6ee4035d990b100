"""Values that are computed from parameters: ``$a / $b``, ``-$K``, ``2 pi * $rate``, ``sqrt($mass)``."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import TYPE_CHECKING

from quadvis.document import YamlList, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Unknown, known, quoted
from quadvis.units import UnitError

if TYPE_CHECKING:
    from quadvis.units.arithmetic import Values

# A text with a $ is arithmetic if it begins as such: others, such as "%d $GP", stay texts.
_BEGINS = re.compile(r"[-+(\s]*(?:\$[A-Za-z_]|[0-9.]|pi\b|[A-Za-z]\w*\s*\()", re.ASCII)
_NAMED = re.compile(r"\$([A-Za-z_]\w*)", re.ASCII)


class _Reported(Exception):
    """A parameter has a fault that is reported."""


class ComputedScalar(YamlScalar):
    """The value of an expression at the place of the expression."""

    __slots__ = ("written",)

    def __init__(self, value: str, node: YamlScalar, key: str) -> None:
        super().__init__(value, True, node.file, node.line, node.column, key, node.odd)
        self.written = node.value

    def _label(self) -> str:
        written = quoted(self.written)
        return f"{quoted(self.key)}, which is {written}: " if self.key else f"{written}: "


def is_computed(text: str) -> bool:
    """Say whether a text is meant as arithmetic with parameters."""
    return "$" in text and _BEGINS.match(text) is not None


def names_in(text: str) -> set[str]:
    """Return the parameters in such a text."""
    return set(_NAMED.findall(text)) if is_computed(text) else set()


def computed(
    node: YamlScalar, lookup: Callable[[YamlScalar], YamlNode | Unknown], faults: Faults
) -> YamlNode | Unknown:
    """Return the value of an expression as a node; ``lookup`` returns the parameter that a text names.

    A parameter that is a list gives a list, element by element.
    """
    from quadvis.units.arithmetic import evaluate  # most diagrams compute nothing
    from quadvis.units.expression import parse_expression

    def value_of(name: str) -> Values:
        found = lookup(YamlScalar(name, node.plain, node.file, node.line, node.column, node.key))
        if not known(found):
            raise _Reported
        return _values(found, name)

    try:
        return _written(evaluate(parse_expression(node.value), value_of), node, node.key)
    except _Reported:
        return UNKNOWN
    except UnitError as error:
        label = f"{quoted(node.key)}: " if node.key else ""
        whole = "" if quoted(node.value) in error.problem else f"{quoted(node.value)}: "
        faults.add(node.place, label + whole + error.problem, error.remedy)
        return UNKNOWN


def _values(node: YamlNode, name: str) -> Values:
    if isinstance(node, YamlList):
        return [_values(child, name) for child in node]
    if not isinstance(node, YamlScalar):
        raise UnitError(f"{quoted(name)} is {node._described()}, not a number", "write '$group.name'")
    from quadvis.units.arithmetic import arithmetic

    try:
        return arithmetic(node.value)
    except UnitError:
        if node.value[:1].isdigit():
            raise
        raise UnitError(f"{quoted(name)} is {quoted(node.value)}, which is no number") from None


def _written(value: Values, node: YamlScalar, key: str) -> YamlNode:
    if not isinstance(value, list):
        return ComputedScalar(value.text, node, key)
    children = [_written(child, node, f"{key}[{index}]") for index, child in enumerate(value)]
    return YamlList(children, node.file, node.line, node.column, key)
