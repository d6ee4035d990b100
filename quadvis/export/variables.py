"""The variables of an FMU that is made of a program: inputs, outputs and parameters with their slots."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from quadvis.engine.engine import Engine
from quadvis.engine.memory import Slot
from quadvis.export.selection import WHOLE, ExportSelection

INPUT, OUTPUT, PARAMETER = "input", "output", "parameter"
KINDS = {"float64": "d", "int64": "q", "bool": "b"}


@dataclass(frozen=True)
class ExportedVariable:
    """A variable: ``slots`` has the slot of each element in memory, ``start`` their values in SI units.

    ``above`` and ``below`` are limits of a parameter, inclusive; ``follows`` are the inputs, by name, that an
    output follows at the same instant.
    """

    name: str
    role: str
    scalar: str
    slots: tuple[int, ...]
    shape: tuple[int, ...]
    unit: str
    doc: str
    start: tuple[Any, ...]
    least: float
    most: float
    follows: tuple[str, ...] = ()

    def elements(self) -> Iterator[tuple[str, int, Any]]:
        """Yield the name, the slot and the start value of each element, as FMI 2.0 counts: from 1."""
        if not self.shape:
            yield self.name, self.slots[0], self.start[0]
            return
        for place, slot, start in zip(
            product(*(range(size) for size in self.shape)), self.slots, self.start, strict=True
        ):
            yield f"{self.name}[{','.join(str(index + 1) for index in place)}]", slot, start


def variables_of(selection: ExportSelection, engine: Engine) -> list[ExportedVariable]:
    """Return the variables of a selection, whose graph an engine runs; no two have one name."""
    found = [*_terminals(selection, engine), *_parameters(selection, engine)]
    names = set[str]()
    made = []
    for variable in found:
        name = variable.name
        if name in names:  # a part may have an input and an output of one name
            name = f"{name}_out" if variable.role == OUTPUT else f"{name}_parameter"
        names.add(name)
        made.append(ExportedVariable(**{**vars(variable), "name": name}))
    return made


def _terminals(selection: ExportSelection, engine: Engine) -> Iterator[ExportedVariable]:
    following = _Following(selection)
    for role, terminals in ((INPUT, selection.inputs), (OUTPUT, selection.outputs)):
        for each in terminals:
            slot = engine.slot(each.block, each.port)
            slots = tuple(slot.position + element for element in each.elements)
            start = _values(engine, each.scalar, slots)
            follows = following.inputs(each.block) if role == OUTPUT else ()
            declared = selection.graph[each.block].block.interface.outputs.get(each.port)
            doc = declared.doc if declared is not None and role == OUTPUT else ""
            unit = each.unit if each.scalar == "float64" else ""
            yield ExportedVariable(
                each.name, role, each.scalar, slots, each.shape, unit, doc, start, -np.inf, np.inf, follows
            )


def _values(engine: Engine, scalar: str, slots: tuple[int, ...]) -> tuple[Any, ...]:
    return tuple(engine.memory.read(Slot(scalar, (), slot)) for slot in slots)


def _parameters(selection: ExportSelection, engine: Engine) -> Iterator[ExportedVariable]:
    """Yield the parameters that may change during a run."""
    prefix = "" if selection.name == WHOLE else f"{selection.name}/"
    for tunable in engine.program.tunables:
        node = selection.graph[tunable.path]
        param = node.block.interface.params[tunable.name]
        path = tunable.path.removeprefix(prefix) if tunable.path != selection.name else ""
        name = ".".join([*(path.split("/") if path else ()), tunable.name])
        slots = tuple(range(tunable.slot.position, tunable.slot.position + tunable.slot.size))
        units = node.units.get(tunable.name)
        unit = str(units[0]) if units and len(set(units)) == 1 else "" if units else str(param.units[0])
        least, most = _limits(param)
        yield ExportedVariable(
            name, PARAMETER, tunable.slot.scalar, slots, tunable.slot.shape,
            unit if tunable.slot.scalar == "float64" else "", param.doc,
            _values(engine, tunable.slot.scalar, slots), least, most,
        )  # fmt: skip


def _limits(param: Any) -> tuple[float, float]:
    """Return the least and the most value that a parameter takes."""
    least = -np.inf if param.min is None else float(param.min)
    most = np.inf if param.max is None else float(param.max)
    if param.choices:
        return 0.0, float(len(param.choices) - 1)
    if param.above is not None:
        least = max(least, float(np.nextafter(param.above, np.inf)))
    if param.below is not None:
        most = min(most, float(np.nextafter(param.below, -np.inf)))
    return least, most


class _Following:
    """Which inputs an output follows at the same instant: along wires that are not late."""

    def __init__(self, selection: ExportSelection) -> None:
        self._graph = selection.graph
        self._names: Mapping[str, list[str]] = {}
        for each in selection.inputs:
            self._names = {**self._names, each.block: [*self._names.get(each.block, ()), each.name]}

    def inputs(self, path: str) -> tuple[str, ...]:
        """Return the names of the inputs that a block's outputs follow."""
        seen, waiting = {path}, [path]
        while waiting:
            node = self._graph[waiting.pop()]
            for _, wire in node.wires(node.block.interface.feedthrough):
                if not wire.delayed and wire.block not in seen:
                    seen.add(wire.block)
                    waiting.append(wire.block)
            if node.condition and node.condition not in seen:
                seen.add(node.condition)
                waiting.append(node.condition)
        return tuple(name for block, names in self._names.items() if block in seen for name in names)
