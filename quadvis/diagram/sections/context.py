"""The context of sections that name blocks and signals, and the class of such sections."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection, Mapping, Set
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Any

from quadvis.diagram.parameters import named_parameters, substitute
from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.section import Said, Section, Values
from quadvis.diagram.times import time_text
from quadvis.diagram.wiring import OpenInput, Wiring
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known, suggestion
from quadvis.graph.graph import Graph, Node, Wire
from quadvis.graph.names import wire_text
from quadvis.links.insertion import RECEIVER


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
    declared: Set[str] = frozenset()  # the names of links in the diagram
    values: Values = field(default_factory=Values)
    # What stands for each name by its place: the full name of a signal, the value of a parameter.
    meant: dict[Place, Any] = field(default_factory=dict)

    @cached_property
    def nodes(self) -> Mapping[str, Node]:
        """The blocks and links by path."""
        return {node.path: node for node in self.graph.nodes if not node.hidden}

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
        if reference.block in self.added:
            return self._of_added(reference)
        source = self.wiring.find(self.wiring.expansion.root, reference).source
        if isinstance(source, YamlNode):
            self.faults.add(reference.place, "this is a constant, not a signal", "name an output of a block")
        if isinstance(source, OpenInput):
            problem = f"input '{source.port}' of {source.part.subject} is not connected: there is no signal"
            self.faults.add(reference.place, problem, "name an output of a block")
        if not isinstance(source, Wire) or source.block not in self.nodes:
            return UNKNOWN
        self.meant[reference.place] = wire_text(source)
        return source

    @property
    def added(self) -> Set[str]:
        """The names of links, also of those that carry nothing, and of what measures ages."""
        return self.declared | {path for path, node in self.nodes.items() if node.origin}

    def _of_added(self, reference: Reference) -> Wire | Unknown:
        """Return an output of a link, or of what measures an age."""
        node = self.nodes.get(reference.block)
        if node is None or reference.port not in node.block.interface.outputs:
            if node is not None:
                word = "link" if node.origin == RECEIVER else "age"
                problem = f"{word} '{reference.block}' has no output '{reference.port}'"
                remedy = suggestion(reference.port, node.block.interface.outputs)
            else:
                problem, remedy = f"link '{reference.block}' carries nothing", "name another signal"
            if not self.faults:  # else what it carries may be unknown
                self.faults.add(reference.place, problem, remedy)
            return UNKNOWN
        wire = Wire(reference.block, reference.port, reference.index)
        self.meant[reference.place] = wire_text(wire)
        return wire

    def filled(self, fields: YamlMap, keys: Collection[str]) -> YamlMap:
        """Return a map with ``$name`` and ``$name[2]`` under these keys replaced by what they name.

        A key whose value has a fault is left out.
        """
        values = dict(fields.values)
        for key in keys:
            node = fields.get(key)
            if not isinstance(node, YamlScalar) or not named_parameters(node):
                continue
            found = substitute(node, self.wiring.expansion.root.params, self.faults)
            if known(found):
                values[key], self.meant[node.place] = found, found.to_python()
            else:
                del values[key]
        return YamlMap(fields.keys, values, fields.file, fields.line, fields.column, fields.key)

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
        """Return a section as plain data: signals that were read by their full names, parameters by value."""
        if isinstance(node, YamlList):
            return [self.written(child) for child in node]
        if isinstance(node, YamlMap):
            return {key: self.written(child) for key, child in node.values.items()}
        if node is None:
            return None
        return self.meant[node.place] if node.place in self.meant else node.to_python()


class RunSection(Section[Said]):
    """A section that names blocks and signals: it is about the recording and the results of a run."""

    @abstractmethod
    def read(self, node: YamlNode | None, context: Context) -> Said:
        """Return the value of the section; ``node`` is None if the key is not written."""
