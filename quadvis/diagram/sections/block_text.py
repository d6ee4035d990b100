"""Blocks as a resolved diagram has them: every parameter is written out, with the unit that was found.

Nothing depends on the machine: paths are relative to the diagram's folder, or name files of quadvis's own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from quadvis.block import Param, entry_name
from quadvis.graph.graph import CONTINUOUS, Node, Wire, selected
from quadvis.graph.names import wire_text
from quadvis.links.insertion import written
from quadvis.links.message import MessageSignal
from quadvis.machine.shipped import portable_name
from quadvis.units import Unit


def resolved_block(node: Node, folder: Path, nodes: Mapping[str, Node]) -> dict[str, Any]:
    """Return a block of some nodes with all its parameters and inputs; paths are relative to ``folder``."""
    found: dict[str, Any] = {
        "block": node.kind,
        "rate": CONTINUOUS if node.task.continuous else node.task.name,
    }
    if node.computer:
        found["at"] = node.computer
    if node.stream not in ("", node.path):
        found["stream"] = node.stream
    if node.condition:
        found["condition"] = node.condition
    values = {
        name: _parameter(node, param, folder)
        for name, param in node.block.interface.params.items()
        if param.choices
        or param.is_text
        or np.isfinite(getattr(node.block, name)).all()  # only defaults may not be
    }
    inputs: dict[str, Any] = {}
    for port, source in node.inputs.items():
        if isinstance(source, Wire):
            inputs[port] = _wire(source, nodes)
        elif source.value is not node.block.interface.inputs[port].default:
            inputs[port] = quantity(node, port, source.value)
    for port, count in node.block.entry_counts.items():
        inputs[port] = [inputs.pop(entry_name(port, number)) for number in range(count)]
    return found | ({"with": values} if values else {}) | ({"in": inputs} if inputs else {})


def _wire(source: Wire, nodes: Mapping[str, Node]) -> Any:
    """Return a wire: its source, and how it crosses between rates and computers."""
    carried = written(nodes, source)
    found: dict[str, Any] = {"from": wire_text(carried.wire if carried else source)}
    if source.crossing:
        found["across"] = source.crossing
    if carried and carried.link.declared:
        found["over"] = carried.link.name
    if carried and carried.signal.given and np.isfinite(carried.signal.initial).all():
        found["initial"] = _initial(carried.signal, source)
    return found if len(found) > 1 else found["from"]


def _initial(signal: MessageSignal, wire: Wire) -> Any:
    """Return the value before the first message of the elements that a wire takes."""
    part = selected(signal.shape, wire.index)
    assert part is not None, "the checker refuses parts that are not in one piece"
    units = signal.units[part[0] : part[0] + math.prod(part[1])]
    return _with_units(units, np.asarray(signal.initial)[wire.index])


def _parameter(node: Node, param: Param, folder: Path) -> Any:
    value = getattr(node.block, param.name)
    if param.choices:
        return param.choices[value]
    if param.is_text:
        return portable_name(value, folder) if param.is_file and value else value
    return quantity(node, param.name, value)


def constant_text(node: Node, port: str, value: Any) -> str:
    """Return a constant input as a diagram writes it."""
    found = quantity(node, port, value)
    return f"{found['value']} {found['unit']}" if isinstance(found, dict) else str(found)


def quantity(node: Node, name: str, value: Any) -> Any:
    """Return the value of a parameter or of a constant input, in the units that the checker found for it."""
    return _with_units(node.units[name], value)


def _with_units(units: Sequence[Unit], value: Any) -> Any:
    """Return a value with one unit for each of its elements."""
    array = np.asarray(value)
    texts = [str(unit) if unit.symbols else "" for unit in units]
    if array.dtype != float or not any(texts):
        return array.tolist()
    if array.ndim == 0:
        return f"{float(array)!r} {texts[0]}"
    if len(set(texts)) == 1:
        return {"value": array.tolist(), "unit": texts[0]}
    if array.ndim == 1:
        return {"value": array.tolist(), "unit": " ".join(text or "1" for text in texts)}
    quantities = [
        f"{number!r} {text}".strip() for number, text in zip(array.ravel().tolist(), texts, strict=True)
    ]
    return np.reshape(np.array(quantities, dtype=object), array.shape).tolist()
