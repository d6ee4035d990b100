"""A checked diagram written out as one flat file: what a log keeps, and what its hash is made of.

Nothing in it depends on the machine: paths are relative to the diagram's folder, and each file that a
parameter names is held by the SHA-256 of its contents.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np

from quadvis.block import Param
from quadvis.diagram.loader import CONTINUOUS, VERSION, FileSpec
from quadvis.diagram.observe import Observation
from quadvis.document import dump_yaml
from quadvis.engine.graph import Graph, Node, Wire
from quadvis.engine.names import wire_text
from quadvis.errors import Faults
from quadvis.machine.inputs import file_digest


def resolved_text(
    graph: Graph,
    stop_time: Fraction,
    seed: int,
    observation: Observation,
    folder: Path,
    digests: Mapping[str, str],
) -> str:
    """Return the diagram with parts expanded, variant and settings applied and every parameter written out.

    It loads in ``folder``, and gives the same run to the bit. ``digests`` has the SHA-256 of the files that
    were read, by path.
    """
    rates = {
        task.name: {"rate": f"{task.period} s", "offset": f"{task.offset} s"}
        if task.offset
        else f"{task.period} s"
        for task in graph.tasks
        if not task.continuous
    }
    data: dict[str, Any] = {"quadvis": VERSION, "name": graph.name}
    if rates:
        data["rates"] = rates
    if graph.step is not None:
        data["solver"] = {"method": graph.solver, "step": f"{graph.step} s"}
    data |= {"stop_time": f"{stop_time} s", "seed": seed}
    files = {path: digests[path] for path in _files(graph) if path in digests}
    if files:
        data["files"] = {_relative(path, folder): digest for path, digest in sorted(files.items())}
    data["blocks"] = {node.path: _block(node, folder) for node in graph.nodes}
    data["log"] = {"signals": observation.logged, "every": observation.every}
    return dump_yaml(data | observation.sections)


def _files(graph: Graph) -> list[str]:
    """Return the paths that parameters name to be read."""
    return [
        getattr(node.block, param.name)
        for node in graph.nodes
        for param in node.block.interface.params.values()
        if param.is_file and not param.writes
    ]


def check_files(spec: FileSpec, faults: Faults) -> None:
    """Tell the files that are not what they were when the diagram was written out."""
    for name, node in spec.files.items():
        wanted = faults.collect(node.text)
        path = spec.path.parent / name
        if not os.path.isfile(path):
            faults.add(node.place, f"there is no file '{name}'", "paths are relative to the diagram")
        elif wanted is not None and file_digest(path) != wanted:
            faults.add(
                node.place,
                f"file '{name}' is not what it was: its SHA-256 differs",
                "bring that one back, or leave the entry out",
            )


def _relative(path: str, folder: Path) -> str:
    """Return a path as a diagram in a folder writes it, wherever that folder is."""
    return Path(os.path.relpath(path, folder)).as_posix()


def _block(node: Node, folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = {
        "block": node.kind,
        "rate": CONTINUOUS if node.task.continuous else node.task.name,
    }
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
            text = wire_text(source)
            inputs[port] = {"from": text, "across": source.crossing} if source.crossing else text
        elif source.value is not node.block.interface.inputs[port].default:
            inputs[port] = _quantity(node, port, source.value)
    return found | ({"with": values} if values else {}) | ({"in": inputs} if inputs else {})


def _parameter(node: Node, param: Param, folder: Path) -> Any:
    value = getattr(node.block, param.name)
    if param.choices:
        return param.choices[value]
    if param.is_text:
        return _relative(value, folder) if param.is_file and value else value
    return _quantity(node, param.name, value)


def constant_text(node: Node, port: str, value: Any) -> str:
    """Return a constant input as a diagram writes it."""
    found = _quantity(node, port, value)
    return f"{found['value']} {found['unit']}" if isinstance(found, dict) else str(found)


def _quantity(node: Node, name: str, value: Any) -> Any:
    """Return a value in the units that the checker found for it."""
    array = np.asarray(value)
    texts = [str(unit) if unit.symbols else "" for unit in node.units[name]]
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
