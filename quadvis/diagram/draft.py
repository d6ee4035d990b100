"""Blocks and wires before they are checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from quadvis.block import Block, In, Interface
from quadvis.diagram.values import OpenUnits, shape_text
from quadvis.document import YamlNode
from quadvis.errors import Place, Unknown, known
from quadvis.graph.graph import Constant, Task, Wire
from quadvis.graph.names import index_text

Key = tuple[str, str]  # block and input


@dataclass
class Connection:
    """One input as the diagram gives it, with the place to name in a fault."""

    place: Place
    source: Wire | Constant | Unknown
    units: OpenUnits = ()  # of a constant, where the declaration leaves them open
    across: Place | Unknown | None = None  # where the crossing is written
    over: YamlNode | None = None  # the link that carries it
    initial: YamlNode | None = None  # its value before the first message


@dataclass
class Draft:
    """A block whose wires are not checked yet."""

    path: str
    place: Place
    kind: str
    type: type[Block]
    block: Block | Unknown
    task: Task | Unknown
    connections: dict[str, Connection]
    places: Mapping[str, Place] = field(default_factory=dict)  # of the parameters that are given
    units: Mapping[str, OpenUnits] = field(default_factory=dict)  # of the parameters where they are open
    given: Mapping[str, YamlNode | Unknown] = field(default_factory=dict)  # their values as written
    stream: str = ""  # the name of its noise
    inherits: bool = False  # whether the inputs are those of the block that it replaces
    computer: str | Unknown = ""
    condition: str | Unknown = ""  # the block that says when this one runs

    def origin(self, name: str) -> Place:
        """Return where the value of a parameter or constant is written."""
        if name in self.connections:
            return self.connections[name].place
        node = self.given[name]
        return node.place if known(node) else self.places[name]

    @property
    def interface(self) -> Interface:
        """The declarations of the block, which are known even if its parameters are not."""
        return self.type.interface


class DraftWire(NamedTuple):
    """A wire whose two ports exist."""

    draft: Draft
    port: str
    connection: Connection
    wire: Wire
    declared: In

    @property
    def key(self) -> Key:
        """Its identity: block and input."""
        return self.draft.path, self.port


def misfit(wire: Wire, shape: Sequence[int]) -> str:
    """Say that an index goes beyond a signal."""
    return f"index {index_text(wire.index)} does not fit '{wire.source}', which has {shape_text(shape)}"


def not_taken(port: str, kind: str) -> tuple[str, str]:
    """Return the problem and the remedy of an input that a block has from the block that it replaces."""
    return f"'{kind}' has no input '{port}' of the block that it replaces", "give it an 'in' of its own"


def unconnected(port: str, declared: In) -> tuple[str, str]:
    """Return the problem and the remedy of an input that nothing feeds."""
    constant = ", or a constant" if declared.signal.scalar != "frame" else ""
    return f"input '{port}' is not connected", f"add '{port}: block.port' under 'in'{constant}"
