"""The main parameters of a block as a picture shows them: short texts with units."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from quadvis.block import Param
from quadvis.graph.graph import Node
from quadvis.output.style import pretty
from quadvis.units import Unit
from quadvis.units.quantity import format_quantity

MOST_NUMBERS = 4  # of an array that is written out
LONGEST = 26  # characters


def main_parameters(node: Node) -> tuple[str, ...]:
    """Return a line for each parameter that the block declares as shown, with its name if there are several.

    Of several, those are left out that have their default and do nothing: 0, no limit, no text.
    """
    shown = [param for param in node.block.interface.params.values() if param.shown]
    if len(shown) == 1:
        return tuple(_cut(text) for text in [parameter_text(node, shown[0])] if text)
    texts = {param.name: parameter_text(node, param) for param in shown if not _is_idle(node, param)}
    return tuple(_cut(f"{name} {text}") for name, text in texts.items() if text)


def parameter_text(node: Node, param: Param) -> str:
    """Return a value of a parameter as a short text: "50 ms", "[1, 2, 3] m", "2 x 3 values"; "" if none."""
    value = getattr(node.block, param.name)
    if param.choices:
        return str(param.choices[value])
    if param.is_text:
        return Path(value).name if param.is_file else "" if param.is_map else str(value)
    array = np.asarray(value)
    if array.ndim > 1 or array.size > MOST_NUMBERS:
        return f"{' x '.join(map(str, array.shape))} values"
    if array.dtype != float:
        return str(array.tolist()).lower()
    declared = () if any(unit.variables for unit in param.units) else param.units
    units = node.units.get(param.name, declared)
    if array.ndim == 0:
        return _quantity(float(array), units)
    if len(set(units)) > 1:
        return ", ".join(
            _quantity(number, (unit,)) for number, unit in zip(array.tolist(), units, strict=True)
        )
    numbers = ", ".join(f"{number:.4g}" for number in array.tolist())
    return f"[{numbers}] {pretty(units[0]) if units else ''}".rstrip()


def _quantity(value: float, units: Sequence[Unit]) -> str:
    """Return a number in a usual size of its unit."""
    if not units or units[0].scale != 1.0:
        return f"{value:.4g} {pretty(units[0]) if units else ''}".rstrip()
    number, _, unit = format_quantity(value, units[0]).partition(" ")
    return f"{number} {pretty(Unit.parse(unit))}" if unit else number


def _is_idle(node: Node, param: Param) -> bool:
    """Say whether a parameter has its default, and this is to do nothing."""
    value = getattr(node.block, param.name)
    if param.choices or param.is_text:
        return not param.choices and value == ""
    array = np.asarray(value, float)
    return not np.isfinite(array).any() or (np.array_equal(value, param.default) and not array.any())


def _cut(text: str) -> str:
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 1]}…"
