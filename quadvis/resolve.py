"""A checked diagram written out as one flat file: what a log keeps, and what its hash is made of."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Declared, Param, units_of
from quadvis.document import dump_yaml
from quadvis.graph import Graph, Node, Wire
from quadvis.loader import CONTINUOUS, VERSION, FileSpec, index_text
from quadvis.observe import Observation


def resolved_text(spec: FileSpec, graph: Graph, stop_time: Any, seed: int, observation: Observation) -> str:
    """Return the diagram with parts expanded, variant and settings applied and every parameter written out."""
    rates = {
        task.name: {"rate": f"{task.period} s", "offset": f"{task.offset} s"} if task.offset else f"{task.period} s"
        for task in graph.tasks
        if not task.continuous
    }
    data: dict[str, Any] = {"quadvis": VERSION, "name": spec.name}
    data["rates"] = rates
    if graph.step is not None:
        data["solver"] = {"method": graph.solver, "step": f"{graph.step} s"}
    data["stop_time"] = f"{stop_time} s"
    data["seed"] = seed
    data["blocks"] = {node.path: _block(node) for node in graph.nodes}
    data["log"] = {"signals": observation.logged, "every": observation.every}
    data |= observation.sections
    if observation.figures:
        data["figures"] = observation.figures
    return dump_yaml(data)


def _block(node: Node) -> dict[str, Any]:
    found: dict[str, Any] = {"block": node.kind, "rate": CONTINUOUS if node.task.continuous else node.task.name}
    interface = node.block.interface
    values = {name: _parameter(param, getattr(node.block, name)) for name, param in interface.params.items()}
    if values:
        found["with"] = values
    inputs: dict[str, Any] = {}
    for port, source in node.inputs.items():
        if isinstance(source, Wire):
            text = wire_text(source)
            inputs[port] = {"from": text, "across": source.crossing} if source.crossing else text
        elif source.value is not interface.inputs[port].default:
            inputs[port] = _quantity(interface.inputs[port], source.value)
    if inputs:
        found["in"] = inputs
    return found


def wire_text(wire: Wire) -> str:
    """Return a wire's source as a diagram writes it."""
    return wire.source + index_text(wire.index)


def constant_text(declared: Declared, value: Any) -> str:
    """Return a constant input as a diagram writes it."""
    found = _quantity(declared, value)
    return str(found["value"]) + f" {found['unit']}" if isinstance(found, dict) else str(found)


def _parameter(param: Param, value: Any) -> Any:
    if param.choices:
        return param.choices[value]
    return value if param.is_text else _quantity(param, value)


def _quantity(declared: Declared, value: Any) -> Any:
    array = np.asarray(value)
    units = units_of(declared, max(1, array.size))
    if array.dtype != float or not any(unit.symbols for unit in units) or any(unit.variables for unit in units):
        return array.tolist()
    if array.ndim == 0:
        return f"{float(array)!r} {units[0]}"
    return {"value": array.tolist(), "unit": declared.unit}
