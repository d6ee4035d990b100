"""A group: parameters that several blocks share, such as the mass and the arm of a craft, from one file.

params:
  vehicle: {group: crafts/draganfly.yaml}     # its params: mass, arm, inertia
blocks:
  body: {block: plant.rotorcraft, group: $vehicle}                     # takes what it has parameters for
  law: {block: control.altitude, with: {mass: $vehicle.mass}}          # takes one by name
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from quadvis.document import YamlMap, YamlNode
from quadvis.errors import Unknown, known

GROUP_KEY = "group"  # in a parameter it names the file, in a block the groups from which it takes parameters
Entries = Mapping[str, YamlNode | Unknown]


@dataclass
class Use:
    """What blocks took of a group's file, and which parameters those have that took a group whole."""

    taken: set[str] = field(default_factory=set)
    wanted: set[str] = field(default_factory=set)


class Group(YamlNode):
    """The parameters of a group's file by name, at the place where a diagram names the file."""

    __slots__ = ("entries", "use")

    def __init__(self, entries: Entries, use: Use, named: YamlNode) -> None:
        super().__init__(named.file, named.line, named.column, named.key)
        self.entries, self.use = entries, use

    def take(self, name: str) -> YamlNode | Unknown:
        """Return a parameter that the group has; it counts as used."""
        self.use.taken.add(name)
        return self.entries[name]

    def take_all(self, declared: Mapping[str, Any]) -> dict[str, YamlNode | Unknown]:
        """Return the parameters that the group has of those declared."""
        self.use.wanted.update(declared)
        return {name: self.take(name) for name in self.entries if name in declared}

    def replaced(self, entries: Entries) -> Group:
        """Return the group with other values of some parameters."""
        return Group({**self.entries, **entries}, self.use, self)

    def settled(self, entries: Entries) -> Group:
        """Return the group with its computed parameters; the group itself if there are none."""
        return self if entries is self.entries else Group(entries, self.use, self)

    def to_python(self) -> Any:
        """Return the values by name."""
        return {name: node.to_python() for name, node in self.entries.items() if known(node)}

    def _described(self) -> str:
        return "a group of parameters"


def names_group(node: YamlNode | Unknown) -> bool:
    """Say whether a parameter's value is ``{group: file}``, or was."""
    return isinstance(node, Group) or (isinstance(node, YamlMap) and GROUP_KEY in node)
