"""The names that the blocks of one file see, and blocks under their full paths."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

from quadvis.block import Block
from quadvis.diagram.sections.blocks import BLOCKS, BlockSpec
from quadvis.diagram.sections.conditional import PartCondition
from quadvis.diagram.spec import FileSpec
from quadvis.document import YamlNode
from quadvis.errors import Place, Unknown, known
from quadvis.graph.graph import Wire


@dataclass
class Scope:
    """The names that one file's blocks see; ``prefix`` is the path of the part that the file is used for."""

    prefix: str
    spec: FileSpec
    params: Mapping[str, YamlNode | Unknown]
    parent: Scope | None = None
    instance: BlockSpec | None = None
    children: dict[str, Scope | Unknown] = field(default_factory=dict)

    def knows(self, name: str) -> bool:
        """Say whether nothing that a name leads to, block or part, is `UNKNOWN`."""
        blocks, children, head = self.spec[BLOCKS], self.children, name.partition("/")[0]
        found = blocks.get(name), blocks.get(head), children.get(name), children.get(head)
        return all(map(known, found))

    @property
    def parts(self) -> Iterator[Scope]:
        """The parts whose files are known."""
        yield from (child for child in self.children.values() if known(child))

    @property
    def runs(self) -> PartCondition | None:
        """When the part runs, if not always and if that is known."""
        runs = self.instance.runs if self.instance is not None else None
        return runs if runs is not None and known(runs) else None

    @property
    def subject(self) -> str:
        """How a fault names the part."""
        return f"block '{self.prefix[:-1]}'"


@dataclass
class FlatBlock:
    """One block of the catalogue under its full path."""

    path: str
    spec: BlockSpec
    scope: Scope
    kind: type[Block] | Unknown
    parameters: dict[str, YamlNode | Unknown]
    places: Mapping[str, Place]  # of the names of the parameters
    wires: Mapping[str, Wire] = field(default_factory=dict)  # that no file has, since the block is added
    condition: str | Unknown = ""  # the block that says when this one runs

    @cached_property
    def rate(self) -> tuple[str, Place] | Unknown | None:
        """The block's rate, or that of the nearest part around it that has one."""
        return next((spec.rate for spec in self.around if spec.rate is not None), None)

    @cached_property
    def at(self) -> tuple[str, Place] | Unknown | None:
        """The computer that runs the block, its own or that of the nearest part around it that has one."""
        return next((spec.at for spec in self.around if spec.at is not None), None)

    @cached_property
    def stream(self) -> str:
        """The name of the block's noise: its path, unless it or a part around it has a stream of its own."""
        inside = ""
        for spec in self.around:
            if spec.stream is not None:
                return spec.stream[0] + inside
            inside = f"/{spec.name}{inside}"
        return self.path

    @property
    def around(self) -> Iterator[BlockSpec]:
        """The block's entry, then those of the parts around it."""
        yield self.spec
        scope = self.scope
        while scope.instance is not None and scope.parent is not None:
            yield scope.instance
            scope = scope.parent

    def place(self, parameter: str) -> Place:
        """Where a parameter is given its value."""
        return self.places[parameter]
