"""A parameter that an analysis varies: of the diagram, of a part or of a block, or one element of it."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np

from quadvis.diagram.group import Group
from quadvis.diagram.scope import Scope
from quadvis.diagram.values import si
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlList, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, DiagramError, Unknown, known, suggestion
from quadvis.graph.graph import Graph, Node
from quadvis.graph.names import PATH, PORT
from quadvis.units import Unit, UnitError, parse_quantity

NAME = re.compile(rf"(?:(?P<block>{PATH})\.)?(?P<parameter>{PORT})(?:\[(?P<element>\d{{1,6}})\])?", re.ASCII)


class Variable(NamedTuple):
    """A parameter, or an element of one; ``parameter`` is its name for ``--set``, ``others`` all elements.

    ``text`` is its own value as it is written.
    """

    name: str
    parameter: str
    unit: Unit
    element: int | None = None
    others: tuple[str, ...] = ()
    text: str = ""

    @property
    def value(self) -> float:
        """Its own value (SI); NaN if it cannot be read."""
        try:
            return parse_quantity(self.text)[0]
        except UnitError:
            return math.nan

    def setting(self, value: float) -> str:
        """Return the setting for a value (SI): ``eyes/camera.latency=0.25 s``."""
        text = f"{value!r} {self.unit}" if self.unit.symbols else repr(value)
        if self.element is not None:
            texts = [text if index == self.element else other for index, other in enumerate(self.others)]
            text = f"[{', '.join(texts)}]"
        return f"{self.parameter}={text}"


def find_variable(wiring: Wiring, graph: Graph, node: YamlNode) -> Variable:
    """Return the parameter that a text names; DiagramError if it does not exist, or is no real number."""
    text = node.text()
    match = NAME.fullmatch(text)
    if match is None:
        remedy = "write block.parameter, a parameter of the diagram, or one with an element: target[3]"
        raise node.fault(f"'{text}' is not a parameter", remedy)
    path, name = match["block"] or "", match["parameter"]
    units, texts = _values(wiring, graph, node, path, name)
    parameter = f"{path}.{name}" if path else name
    if match["element"] is None:
        if len(texts) != 1:
            raise node.fault(f"'{text}' has {len(texts)} elements", f"vary one of them, such as {text}[0]")
        return Variable(text, parameter, units[0], text=texts[0])
    element = int(match["element"])
    if element >= len(texts) or len(texts) == 1:
        raise node.fault(f"'{parameter}' has no element [{element}]", "count from 0")
    return Variable(text, parameter, units[element], element, texts, texts[element])


def _values(
    wiring: Wiring, graph: Graph, node: YamlNode, path: str, name: str
) -> tuple[list[Unit], tuple[str, ...]]:
    """Return the units and the texts of a parameter's elements."""
    scope: Scope | Unknown = wiring.expansion.root
    group = wiring.expansion.root.params.get(path)
    if isinstance(group, Group):
        if name not in group.entries:
            raise node.fault(f"group '{path}' has no parameter '{name}'", suggestion(name, group.entries))
        return _written(wiring, node, name, group.entries[name])
    for part in path.split("/") if path else ():
        scope = scope.children.get(part, UNKNOWN) if known(scope) else UNKNOWN
    if known(scope):
        if name not in scope.params:
            where = f"part '{path}'" if path else "the diagram"
            raise node.fault(f"{where} has no parameter '{name}'", suggestion(name, scope.params))
        return _written(wiring, node, name, scope.params[name])
    paths = {block.path: block for block in graph.nodes}
    if path not in paths:
        raise node.fault(f"there is no block '{path}'", suggestion(path, paths))
    return _given(node, paths[path], name)


def _written(
    wiring: Wiring, node: YamlNode, name: str, value: YamlNode | Unknown
) -> tuple[list[Unit], tuple[str, ...]]:
    leaves = list(value) if isinstance(value, YamlList) else [value]
    if any(leaf is UNKNOWN or wiring.faults.reported(leaf.place) for leaf in leaves):
        raise DiagramError(())
    units, texts = [], []
    for leaf in leaves:
        try:
            unit = parse_quantity(leaf.value)[1] if isinstance(leaf, YamlScalar) else None
        except UnitError:
            unit = None
        if unit is None or not isinstance(leaf, YamlScalar):
            raise node.fault(f"parameter '{name}' is not a number", "vary one that is")
        units.append(si(unit))
        texts.append(leaf.value)
    return units, tuple(texts)


def _given(node: YamlNode, block: Node, name: str) -> tuple[list[Unit], tuple[str, ...]]:
    params = block.block.interface.params
    if name not in params:
        raise node.fault(f"block '{block.path}' has no parameter '{name}'", suggestion(name, params))
    value = np.asarray(getattr(block.block, name, None))
    if params[name].signal.scalar != "float64" or params[name].is_text or value.ndim > 1:
        raise node.fault(f"parameter '{name}' is not a real number", "vary one that is")
    units = list(block.units[name]) if name in block.units else list(params[name].units)
    flat = np.ravel(value).tolist()
    units = units * len(flat) if len(units) == 1 else units
    texts = (
        f"{number!r} {unit}" if unit.symbols else repr(number)
        for number, unit in zip(flat, units, strict=True)
    )
    return units, tuple(texts)
