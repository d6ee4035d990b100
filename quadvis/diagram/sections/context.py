"""The context of sections that name blocks and signals, and the class of such sections."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.section import Said, Section, Values
from quadvis.diagram.times import time_text
from quadvis.diagram.wiring import OpenInput, Wiring
from quadvis.document import YamlList, YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known
from quadvis.graph.graph import Graph, Node, Wire
from quadvis.graph.names import wire_text


@dataclass
class Context:
    """The blocks that exist, and when the run ends (s); faults are collected.

    ``shortened`` says that the diagram by itself ends later. ``values`` has the sections that are read
    already.
    """

    wiring: Wiring
    graph: Graph
    stop: Fraction
    shortened: bool
    faults: Faults
    values: Values = field(default_factory=Values)
    names: dict[Place, str] = field(default_factory=dict)  # the full name of each signal, by where it stands

    @cached_property
    def nodes(self) -> Mapping[str, Node]:
        """The blocks by path."""
        return {node.path: node for node in self.graph.nodes}

    @property
    def is_whole(self) -> bool:
        """Whether all blocks are known, so that a name that fits none of them is a fault."""
        return self.wiring.expansion.is_whole

    def wire(self, node: YamlNode) -> Wire | Unknown:
        """Return the output that the name of a signal means."""
        reference = read_reference(node, self.faults)
        return self.source(reference) if known(reference) else UNKNOWN

    def source(self, reference: Reference) -> Wire | Unknown:
        """Return the output behind a name."""
        source = self.wiring.find(self.wiring.expansion.root, reference).source
        if isinstance(source, YamlNode):
            self.faults.add(reference.place, "this is a constant, not a signal", "name an output of a block")
        if isinstance(source, OpenInput):
            problem = f"input '{source.port}' of {source.part.subject} is not connected: there is no signal"
            self.faults.add(reference.place, problem, "name an output of a block")
        if not isinstance(source, Wire) or source.block not in self.nodes:
            return UNKNOWN
        self.names[reference.place] = wire_text(source)
        return source

    def warn_window(
        self, fields: YamlMap, keys: tuple[str, str], begin: Fraction | None, end: Fraction | None
    ) -> None:
        """Warn of a window that holds no instant of the run, or none at all; ``keys`` name its ends."""
        if begin is not None and begin > self.stop:
            problem = f"'{keys[0]}' is {time_text(begin)}, but the run ends at {time_text(self.stop)}"
            remedy = "begin earlier, or choose a longer stop time"
            self.faults.warn(fields[keys[0]].place, problem, remedy)
        elif begin is not None and end is not None and end < begin:
            problem = f"'{keys[1]}' is {time_text(end)}, which is before {time_text(begin)}"
            self.faults.warn(fields[keys[1]].place, problem, f"end later than '{keys[0]}'")

    def written(self, node: YamlNode | None) -> Any:
        """Return a section as plain data, with every signal that was read by its full name."""
        if isinstance(node, YamlList):
            return [self.written(child) for child in node]
        if isinstance(node, YamlMap):
            return {key: self.written(child) for key, child in node.values.items()}
        return (self.names.get(node.place) or node.to_python()) if node is not None else None


class RunSection(Section[Said]):
    """A section that names blocks and signals: it is about the recording and the results of a run."""

    @abstractmethod
    def read(self, node: YamlNode | None, context: Context) -> Said:
        """Return the value of the section; ``node`` is None if the key is not written."""
