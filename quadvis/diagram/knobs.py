"""Knobs: parameters of the diagram and of parts, by the parameters of blocks to which they give their value.

A parameter that stands alone where a block takes a value, `with: {bandwidth: $bandwidth}`, is that parameter
of the block, through any number of parts. So a run can tune it, if nothing else takes it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from quadvis.diagram.expand import Expansion
from quadvis.diagram.group import Group
from quadvis.diagram.parameters import named_parameters, whole_parameter
from quadvis.diagram.scope import Scope
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.inputs import InputSpec
from quadvis.diagram.sections.links import LINKS
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.sections.ports import PORTS
from quadvis.diagram.timing import timing_nodes
from quadvis.document import YamlNode
from quadvis.document.number_lists import Numbers
from quadvis.errors import known


class Knob(NamedTuple):
    """A parameter of the diagram or of a part.

    ``targets`` are the parameters of blocks that have its value: path and name. ``elsewhere`` is what else
    takes it, in words such as "the input 'law.u'".
    """

    targets: tuple[tuple[str, str], ...]
    elsewhere: tuple[str, ...]


class _Uses:
    """What takes a parameter."""

    def __init__(self) -> None:
        self.targets: dict[tuple[str, str], None] = {}
        self.elsewhere: dict[str, None] = {}

    def extend(self, other: _Uses) -> None:
        self.targets |= other.targets
        self.elsewhere |= other.elsewhere


def find_knobs(expansion: Expansion) -> dict[str, Knob]:
    """Return the knobs of a diagram by name, as a setting names them: ``bandwidth``, ``control.bandwidth``.

    A parameter of a group has the name of the group before its own: ``vehicle.mass``.
    """
    found: dict[str, Knob] = {}
    _Finder(expansion).find(expansion.root, found)
    return found


class _Finder:
    def __init__(self, expansion: Expansion) -> None:
        self._expansion = expansion

    def find(self, scope: Scope, found: dict[str, Knob]) -> Mapping[str, _Uses]:
        """Return what takes each parameter of a scope; add its knobs and those of its parts."""
        uses = {name: _Uses() for name in _names(scope)}
        children = {child.prefix: self.find(child, found) for child in scope.parts}
        for block in scope.spec[BLOCKS].values() if uses else ():
            if known(block):
                self._look(scope, block, uses, children.get(f"{scope.prefix}{block.name}/", {}))
        for words, node in _others(scope) if uses else ():
            for name in _named(node, scope):
                uses[name].elsewhere[words] = None
        for name, use in uses.items():
            if not scope.prefix or "." not in name:
                where = f"{scope.prefix.removesuffix('/')}." if scope.prefix else ""
                group = uses[name.partition(".")[0]]  # what takes some parameter of it by an element
                found[where + name] = Knob(tuple(use.targets), tuple(use.elsewhere | group.elsewhere))
        return uses

    def _look(
        self, scope: Scope, block: BlockSpec, uses: Mapping[str, _Uses], inner: Mapping[str, _Uses]
    ) -> None:
        """Note what an entry takes; ``inner`` is what takes the parameters of the part that it is."""
        path = scope.prefix + block.name
        replaced = self._expansion.overrides.of(path)
        given = block.parameters if known(block.parameters) else {}
        for parameter, node in given.items():
            if parameter not in replaced:
                self._bind(scope, path, parameter, node, uses, inner if block.is_part else None)
        for node in block.groups:
            name = whole_parameter(node) or ""
            group = scope.params.get(name)
            if not isinstance(group, Group):
                continue
            declared = inner if block.is_part else self._declared(path)
            for entry in group.entries:
                if entry in declared and entry not in given and entry not in replaced:
                    _join(uses[f"{name}.{entry}"], path, entry, inner if block.is_part else None)
        for words, given_input in _inputs(path, block):
            for taken in given_input.constants:
                for name in _named(taken, scope):
                    uses[name].elsewhere[words] = None

    def _bind(
        self,
        scope: Scope,
        path: str,
        parameter: str,
        node: YamlNode,
        uses: Mapping[str, _Uses],
        inner: Mapping[str, _Uses] | None,
    ) -> None:
        name = whole_parameter(node)
        if name is None or name not in uses:
            for part in _named(node, scope):
                uses[part].elsewhere[f"a part of '{path}.{parameter}'"] = None
            return
        _join(uses[name], path, parameter, inner)
        group = scope.params.get(name)
        if isinstance(group, Group) and inner is not None:
            for entry in group.entries:
                _join(uses[f"{name}.{entry}"], path, f"{parameter}.{entry}", inner)

    def _declared(self, path: str) -> Mapping[str, object]:
        block = self._expansion.blocks.get(path)
        return block.kind.interface.params if block is not None and known(block.kind) else {}


def _join(use: _Uses, path: str, parameter: str, inner: Mapping[str, _Uses] | None) -> None:
    """Note that a parameter of a block, or of a part with ``inner`` uses, is the parameter of a scope."""
    if inner is None:
        use.targets[path, parameter] = None
    elif parameter in inner:
        use.extend(inner[parameter])


def _names(scope: Scope) -> Iterator[str]:
    """Yield the parameters of a scope, and those of its groups."""
    for name, value in scope.params.items():
        yield name
        if isinstance(value, Group):
            yield from (f"{name}.{entry}" for entry in value.entries)


def _named(node: object, scope: Scope) -> Iterator[str]:
    """Yield the parameters that a value takes in some way."""
    if isinstance(node, YamlNode) and not isinstance(node, Numbers):
        yield from (name for name in named_parameters(node) if name in scope.params)


def _inputs(path: str, block: BlockSpec) -> Iterator[tuple[str, InputSpec]]:
    inputs = block.inputs if block.inputs is not None and known(block.inputs) else {}
    yield from ((f"the input '{path}.{port}'", given) for port, given in inputs.items())
    if block.runs is not None and known(block.runs):
        yield from ((f"a condition of '{path}'", given) for given in block.runs.signals)


def _others(scope: Scope) -> Iterator[tuple[str, YamlNode]]:
    """Yield what takes parameters of a scope besides blocks, with words for it."""
    spec = scope.spec
    yield from ((f"'{key}'", node) for key, node in spec.nodes.items())
    if scope.parent is None:
        yield from (("a rate, the step or the stop time", node) for node in timing_nodes(spec))
    for child in scope.parts:
        for port, given in child.spec[PORTS].defaults.items():
            if isinstance(given.source, YamlNode):
                yield f"the input '{child.prefix.removesuffix('/')}.{port}'", given.source
    for name, link in spec[LINKS].items():
        if known(link):
            yield from ((f"the link '{name}'", node) for node in link.fields.values())
    for node in spec[PARAMS].values():
        if known(node):
            yield "another parameter", node
