"""Parameters that are computed from others of the same file: ``params: {fs: 100 Hz, ts: 1 / $fs}``."""

from __future__ import annotations

from collections.abc import Mapping, Set

from quadvis.diagram.group import Group
from quadvis.diagram.parameters import Params, named_parameters, substitute
from quadvis.document import YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Unknown, known


def settled(params: Params, faults: Faults) -> Mapping[str, YamlNode | Unknown]:
    """Return parameters with those computed that name others, in any order; a circle is a fault."""
    whole = {name: node for name, node in params.items() if type(node) is not YamlScalar or "$" in node.value}
    named = {name: named_parameters(node) for name, node in whole.items() if known(node)}
    if not any(named.values()) and not any(isinstance(node, Group) for node in whole.values()):
        return params
    return _Settling(params, named, faults).all()


class _Settling:
    def __init__(self, params: Params, named: Mapping[str, Set[str]], faults: Faults) -> None:
        self.params, self.named, self.faults = params, named, faults
        self.found: dict[str, YamlNode | Unknown] = {}

    def all(self) -> dict[str, YamlNode | Unknown]:
        for name in self.params:
            self._settle(name, ())
        return {name: self.found[name] for name in self.params}

    def _settle(self, name: str, above: tuple[str, ...]) -> None:
        if name in self.found:
            return
        node = self.params[name]
        if not known(node):
            self.found[name] = UNKNOWN
            return
        with self.faults.about(f"parameter '{name}'"):
            if name in above:
                circle = " needs ".join(f"'{each}'" for each in (*above[above.index(name) :], name))
                self.faults.add(
                    node.place, f"it is computed from itself: {circle}", "give one of them a value"
                )
                self.found[name] = UNKNOWN
                return
        for other in sorted(self.named.get(name, frozenset()) & self.params.keys()):
            self._settle(other, (*above, name))
        if name in self.found:
            return
        with self.faults.about(f"parameter '{name}'"):
            self.found[name] = self._value(name, node)

    def _value(self, name: str, node: YamlNode) -> YamlNode | Unknown:
        if isinstance(node, Group):
            return node.settled(settled(node.entries, self.faults))
        if not self.named.get(name):
            return node
        others = {other: value for other, value in self.params.items() if other != name}
        return substitute(node, {**others, **self.found}, self.faults)
