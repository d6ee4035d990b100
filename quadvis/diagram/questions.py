"""What a diagram asks about its loop: the section ``analyse``, with cut points and limits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from quadvis.diagram.flow import misfit
from quadvis.diagram.reference import read_reference
from quadvis.diagram.times import read_duration
from quadvis.diagram.variable import Variable, find_variable
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.engine.graph import Graph, Wire
from quadvis.engine.names import wire_text
from quadvis.errors import Faults
from quadvis.units import Unit, split_quantity

ANALYSE_KEYS = ("at", "cuts", "limits")
LIMIT_KEYS = ("vary", "from", "to")
AT = 3.0  # s, long enough for most queues to be full


@dataclass(frozen=True)
class CutSignal:
    """A signal, or some elements of it, counted as if it lay flat."""

    text: str
    block: str
    port: str
    elements: tuple[int, ...]


@dataclass(frozen=True)
class Cut:
    """A place where the loop is opened: one signal, or several at once."""

    label: str
    signals: tuple[CutSignal, ...]


@dataclass(frozen=True)
class Limit:
    """A question: how far a parameter can go from ``start`` toward ``end`` (SI) before the loop is unstable.

    ``shown`` is the unit that people read it in.
    """

    label: str
    variable: Variable
    start: float
    end: float
    shown: Unit


@dataclass(frozen=True)
class Questions:
    """All that is asked: the time (s) of the operating point, cuts, limits; ``reader`` takes more of them."""

    reader: QuestionReader
    at: float = AT
    cuts: tuple[Cut, ...] = ()
    limits: tuple[Limit, ...] = ()

    def more(
        self, cuts: Mapping[str, Any], limits: Mapping[str, tuple[str, str, str]]
    ) -> tuple[tuple[Cut, ...], tuple[Limit, ...]]:
        """Return the cuts and limits with others added; DiagramError tells what is wrong with these."""
        faults = Faults()
        reader = replace(self.reader, wiring=Wiring(self.reader.wiring.expansion, faults))
        found = [reader.cut(label, _list(signals), faults) for label, signals in cuts.items()]
        sought = [reader.limit(label, _map(limit), faults) for label, limit in limits.items()]
        faults.check()
        added = tuple(cut for cut in found if cut is not None)
        return self.cuts + added, self.limits + tuple(limit for limit in sought if limit is not None)


def _text(text: str, place: str, key: str = "") -> YamlScalar:
    return YamlScalar(text, False, place, 0, 0, key)


def _list(signals: str | Sequence[str]) -> YamlNode:
    texts = [signals] if isinstance(signals, str) else list(signals)
    return YamlList([_text(text, "--cut") for text in texts], "--cut", 0, 0)


def _map(limit: tuple[str, str, str]) -> YamlMap:
    values: dict[str, YamlNode] = {
        key: _text(text, "--vary", key) for key, text in zip(LIMIT_KEYS, limit, strict=True)
    }
    return YamlMap({}, values, "--vary", 0, 0)


@dataclass(frozen=True)
class QuestionReader:
    """Reads cuts and limits against the blocks and parameters that there are."""

    wiring: Wiring
    graph: Graph
    nodes: Mapping[str, Any] = field(default_factory=dict)

    def read(self, node: YamlNode | None, faults: Faults) -> Questions:
        """Read the section; faults are collected."""
        with faults.about("analyse"):
            fields = faults.collect(node.fields, (), ANALYSE_KEYS, faults) if node is not None else None
            if fields is None:
                return Questions(self)
            at = faults.collect(read_duration, fields["at"]) if "at" in fields else None
            cuts = faults.collect(fields["cuts"].mapping) if "cuts" in fields else None
            limits = faults.collect(fields["limits"].mapping) if "limits" in fields else None
            found = [self.cut(key.value, value, faults) for key, value in cuts.pairs()] if cuts else []
            sought = [self.limit(key.value, value, faults) for key, value in limits.pairs()] if limits else []
        return Questions(
            self,
            AT if at is None else float(at),
            tuple(cut for cut in found if cut is not None),
            tuple(limit for limit in sought if limit is not None),
        )

    def cut(self, label: str, node: YamlNode, faults: Faults) -> Cut | None:
        """Read ``[control/heading.right, control/heading.right_velocity]`` or one signal."""
        items = node.values if isinstance(node, YamlList) else [node]
        if not items:
            faults.add(node.place, f"cut '{label}' has no signals", "name one, such as control/roll.torque")
        found = [self._signal(item, faults) for item in items]
        signals = tuple(signal for signal in found if signal is not None)
        return Cut(label, signals) if signals and len(signals) == len(items) else None

    def _signal(self, node: YamlNode, faults: Faults) -> CutSignal | None:
        reference = read_reference(node, faults)
        if reference is None:
            return None
        source = self.wiring.find(self.wiring.expansion.root, reference).source
        if isinstance(source, YamlNode):
            faults.add(node.place, "this is a constant, not a signal", "name an output of a block")
        if not isinstance(source, Wire) or source.block not in self.nodes:
            return None
        found = self.nodes[source.block]
        declared = found.block.interface.outputs[source.port]
        if declared.signal.scalar != "float64":
            problem = f"'{source.source}' holds {declared.signal.scalar} values, which vary in no small steps"
            faults.add(node.place, problem, "open the loop at a signal of real numbers")
            return None
        if source.port not in found.units:
            return None
        shape = found.shape(source.port)
        try:
            flat = np.arange(math.prod(shape)).reshape(shape)[source.index]
        except IndexError:
            faults.add(node.place, misfit(source, shape), "count from 0" if shape else "leave it out")
            return None
        elements = tuple(int(element) for element in np.ravel(flat))
        return CutSignal(wire_text(source), source.block, source.port, elements)

    def limit(self, label: str, node: YamlNode, faults: Faults) -> Limit | None:
        """Read ``{vary: eyes/camera.latency, from: 50 ms, to: 2 s}``."""
        fields = faults.collect(node.fields, LIMIT_KEYS, (), faults)
        if fields is None or any(key not in fields for key in LIMIT_KEYS):
            return None
        variable = faults.collect(find_variable, self.wiring, self.graph, fields["vary"])
        if variable is None:
            return None
        start, end = (
            faults.collect(fields[key].quantity, variable.unit, bare=False) for key in LIMIT_KEYS[1:]
        )
        if start is None or end is None:
            return None
        if start == end:
            faults.add(fields["to"].place, "'from' and 'to' are the same", "give the end of a range")
            return None
        unit = split_quantity(fields["to"].text())[1]
        return Limit(label, variable, start, end, Unit.parse(unit) if unit else variable.unit)
