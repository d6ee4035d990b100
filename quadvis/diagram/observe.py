"""What a diagram makes of a run: its sections ``log``, ``expect``, ``summary`` and ``figures``."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from fnmatch import fnmatchcase
from fractions import Fraction
from typing import Any

from quadvis.diagram.flow import misfit
from quadvis.diagram.reference import read_reference
from quadvis.diagram.times import read_duration
from quadvis.diagram.unit_flow import words
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.engine.graph import Graph, Node, Wire, selected
from quadvis.engine.names import wire_text
from quadvis.errors import Faults, Place, suggestion
from quadvis.output.plot import read_figures
from quadvis.output.statistics import COUNT, STATISTICS
from quadvis.output.stretch import Sampling, Stretch
from quadvis.output.verdict import EXPECTATIONS, Entry, Expectation, Judging, Outcome, Part, Signals
from quadvis.units import Unit, split_quantity

ONE = Unit()
DEGREE = Unit.parse("deg")

LOG_KEYS = ("signals", "every")
STRETCH_KEYS = ("after", "before", "of")
SUMMARY_KEYS = (*STRETCH_KEYS, "show", "unit")


@dataclass
class Observation:
    """What is recorded of a run and made of it."""

    logged: list[str] = field(default_factory=list)  # paths of blocks
    every: dict[str, int] = field(default_factory=dict)  # of a task's rows one in so many is logged
    expectations: list[Expectation] = field(default_factory=list)
    summary: list[Entry] = field(default_factory=list)
    sections: dict[str, Any] = field(
        default_factory=dict
    )  # expect, summary, figures as data, with full names

    def judging(self) -> Judging:
        """Return what judges a run while it goes on."""
        return Judging(self.summary, self.expectations)

    def judge(self, signals: Signals) -> Outcome:
        """Return the summary and the verdicts of a recorded run."""
        judging = self.judging()
        judging.read(signals)
        return judging.outcome()


def read_observation(
    sections: Mapping[str, YamlNode],
    wiring: Wiring,
    graph: Graph,
    stop: Fraction,
    shortened: bool,
    faults: Faults,
) -> Observation:
    """Read the sections against the blocks that there are; faults are collected.

    The run ends at ``stop`` (s); ``shortened`` says that the diagram by itself ends later.
    """
    reader = _Reader(wiring, graph, stop, shortened, faults)
    with faults.about("log"):
        reader.log(sections.get("log"))
    with faults.about("expect"):
        for node in (faults.collect(sections["expect"].items) or []) if "expect" in sections else []:
            reader.expectation(node)
    with faults.about("summary"):
        entries = faults.collect(sections["summary"].mapping) if "summary" in sections else None
        for key, node in entries.pairs() if entries is not None else []:
            reader.entry(key.value, node)
    with faults.about("figures"):
        if "figures" in sections:
            reader.figures(sections["figures"])
    for section in ("expect", "summary", "figures"):
        if section in sections:
            reader.result.sections[section] = _plain(sections[section], reader.names)
    return reader.result


class _Reader:
    def __init__(self, wiring: Wiring, graph: Graph, stop: Fraction, shortened: bool, faults: Faults) -> None:
        self.wiring, self.stop, self.shortened, self.faults = wiring, stop, shortened, faults
        self.nodes = {node.path: node for node in graph.nodes}
        self.result = Observation()
        self.names: dict[Place, str] = {}  # the full name of each signal, by where it is written

    def log(self, node: YamlNode | None) -> None:
        """Read which blocks are logged, and how often: ``{signals: [craft, "eyes/*"], every: {imu: 10}}``."""
        fields = self.faults.collect(node.fields, (), LOG_KEYS, self.faults) if node is not None else None
        patterns = (
            self.faults.collect(fields["signals"].items)
            if fields is not None and "signals" in fields
            else None
        )
        if patterns is None:
            self.result.logged = list(self.nodes)
        else:
            wanted = {path for pattern in patterns for path in self._matching(pattern)}
            self.result.logged = [path for path in self.nodes if path in wanted]
        tasks = {node.task.name for node in self.nodes.values()}
        every = (
            self.faults.collect(fields["every"].mapping) if fields is not None and "every" in fields else None
        )
        for key, value in every.pairs() if every is not None else []:
            count = self.faults.collect(value.integer)
            if key.value not in tasks and not self.wiring.expansion.unknown:
                self.faults.add(
                    key.place, f"no block runs at a rate '{key.value}'", suggestion(key.value, tasks)
                )
            elif count is not None and count < 1:
                self.faults.add(
                    value.place, "a row cannot be kept more often than it comes", "write 1 or more"
                )
            elif count is not None:
                self.result.every[key.value] = count

    def _matching(self, pattern: YamlNode) -> list[str]:
        """Return the blocks that a pattern names, by themselves, by a part around them or by a signal."""
        text = self.faults.collect(pattern.text)
        if text is None:
            return []
        found = [
            path for path, node in self.nodes.items()
            if fnmatchcase(path, text) or fnmatchcase(path, f"{text}/*")
            or any(fnmatchcase(f"{path}.{port}", text) for port in node.block.interface.outputs)
        ]  # fmt: skip
        if not found and not self.wiring.expansion.unknown:
            remedy = suggestion(text, self.nodes) or "write a block, a part, or a pattern such as 'eyes/*'"
            self.faults.add(pattern.place, f"no block is called '{text}'", remedy)
        return found

    def _signal(self, node: YamlNode) -> tuple[Part, str] | None:
        """Return a signal over the whole run, with its scalar kind; None if it is told to be wrong."""
        reference = read_reference(node, self.faults)
        source = (
            self.wiring.find(self.wiring.expansion.root, reference).source if reference is not None else None
        )
        if isinstance(source, YamlNode):
            self.faults.add(node.place, "this is a constant, not a signal", "name an output of a block")
        if not isinstance(source, Wire) or source.block not in self.nodes:
            return None
        name, found = source.source, self.nodes[source.block]
        scalar = found.block.interface.outputs[source.port].signal.scalar
        if scalar == "frame":
            self.faults.add(node.place, f"'{name}' is a picture, not a number", "name another signal")
        sizes = found.block.interface.outputs[source.port].signal.shape
        is_open = any(isinstance(size, str) and size not in found.sizes for size in sizes)
        if scalar == "frame" or source.port not in found.units or is_open:
            return None
        shape = found.shape(source.port)
        try:
            part = selected(shape, source.index)
        except IndexError:
            self.faults.add(node.place, misfit(source, shape), "count from 0" if shape else "leave it out")
            return None
        if part is None:
            self.faults.add(
                node.place, "the elements do not lie side by side", "take one element, or a run of them"
            )
            return None
        if source.block not in self.result.logged:
            problem = f"block '{source.block}' is not logged"
            self.faults.add(node.place, problem, f"add '{source.block}' under 'log: {{signals: [...]}}'")
        units = set(found.units[source.port][part[0] : part[0] + math.prod(part[1])])
        if len(units) > 1:
            problem = f"the elements of '{name}' have different units: {', '.join(sorted(map(str, units)))}"
            self.faults.add(node.place, problem, "take elements of one unit")
            return None
        self.names[node.place] = text = wire_text(source)
        unit = units.pop()
        shown = DEGREE if str(unit) == "rad" else unit
        stretch = Stretch(self._sampling(found))
        return Part(source.source, source.index, text, unit, shown, 0.0, stretch, shape), scalar

    def _sampling(self, node: Node) -> Sampling:
        """Return when a block's outputs are recorded."""
        task = node.task
        every = self.result.every.get(task.name, 1)
        return Sampling(task.offset, task.period * every, self.stop, self.shortened)

    def _part(self, fields: YamlMap) -> tuple[Part, str] | None:
        """Return the part that an expectation or a line of the summary is about."""
        found = self._signal(fields["signal"]) if "signal" in fields else None
        after, before = (
            self.faults.collect(read_duration, fields[name]) if name in fields else None
            for name in STRETCH_KEYS[:2]
        )
        if found is None:
            return None
        of = self.faults.collect(fields["of"].quantity, found[0].unit, bare=False) if "of" in fields else None
        stretch = replace(found[0].stretch, after=after or Fraction(0), before=before)
        return replace(found[0], of=of or 0.0, stretch=stretch), found[1]

    def expectation(self, node: YamlNode) -> None:
        """Read ``{signal: plant.position[0], after: 20 s, within: 0.15 m}``."""
        fields = self.faults.collect(node.fields, ("signal",), (*STRETCH_KEYS, *EXPECTATIONS), self.faults)
        if fields is None:
            return
        found = self._part(fields)
        kinds = [kind for kind in EXPECTATIONS if kind in fields]
        if not kinds and all(key in ("signal", *STRETCH_KEYS) for key in fields):
            self.faults.add(
                node.place, "nothing is expected of the signal", f"add one of {', '.join(EXPECTATIONS)}"
            )
        for kind in kinds if found is not None else []:
            assert found is not None
            is_count = EXPECTATIONS[kind].statistic == COUNT
            unit = ONE if is_count else found[0].unit
            limit = self.faults.collect(fields[kind].quantity, unit, bare=False)
            if limit is not None:
                shown = _written(fields[kind]) or found[0].shown
                part = found[0] if is_count else replace(found[0], shown=shown)
                self.result.expectations.append(Expectation(part, kind, limit))

    def entry(self, label: str, node: YamlNode) -> None:
        """Read a line of the summary: ``x: {signal: plant.position[0], after: 40 s, show: [rms, max]}``."""
        if not isinstance(node, YamlMap):
            node = YamlMap({}, {"signal": node}, node.file, node.line, node.column)
        fields = self.faults.collect(node.fields, ("signal",), SUMMARY_KEYS, self.faults)
        if fields is None:
            return
        found = self._part(fields)
        names = self.faults.collect(fields["show"].items) if "show" in fields else None
        show = [self.faults.collect(name.choice, STATISTICS) for name in names or []]
        unit = self.faults.collect(fields["unit"].unit) if "unit" in fields else None
        if found is None:
            return
        part, scalar = found
        if unit is not None and not unit.dimension_equals(part.unit):
            problem = f"'{part.text}' has {words(part.unit)}, which is not shown in {words(unit)}"
            self.faults.add(fields["unit"].place, problem, "write a unit of the same kind")
        default = ("rms", "max") if scalar == "float64" else (COUNT,)
        shown = tuple(name for name in show if name is not None) or default
        self.result.summary.append(Entry(label, replace(part, shown=unit or part.shown), shown))

    def figures(self, node: YamlNode) -> None:
        """Read the figures as ``quadvis.output.plot`` will, and look for their signals."""
        read_figures(node, self.faults)
        told = {fault.place for fault in self.faults}
        for panel in _panels(node):
            unit = (
                self.faults.collect(panel["unit"].unit)
                if "unit" in panel and panel["unit"].place not in told
                else None
            )
            for name in _signals(panel):
                found = self._signal(name) if name.place not in told else None
                if found is not None and unit is not None and not unit.dimension_equals(found[0].unit):
                    problem = f"'{found[0].text}' has {words(found[0].unit)}, the panel is in {words(unit)}"
                    self.faults.add(name.place, problem, "give it a panel of its own")


def _written(node: YamlNode) -> Unit | None:
    """Return the unit in which a quantity was written."""
    unit = split_quantity(node.text())[1]
    return Unit.parse(unit) if unit else None


def _panels(node: YamlNode) -> Iterator[YamlMap]:
    """Yield the panels of figures as far as they are maps; a figure may be its own panel."""
    for figure in node if isinstance(node, YamlList) else ():
        panels = figure.get("panels") if isinstance(figure, YamlMap) else None
        for panel in panels if isinstance(panels, YamlList) else (figure,):
            if isinstance(panel, YamlMap):
                yield panel


def _signals(panel: YamlMap) -> Iterator[YamlNode]:
    """Yield the names of signals in a panel."""
    signals = panel.get("signals")
    for item in signals if isinstance(signals, YamlList) else (signals,):
        name = item.get("signal") if isinstance(item, YamlMap) else item
        if isinstance(name, YamlScalar):
            yield name


def _plain(node: YamlNode, names: Mapping[Place, str]) -> Any:
    """Return a section as plain data, with every signal by its full name."""
    if isinstance(node, YamlList):
        return [_plain(child, names) for child in node]
    if isinstance(node, YamlMap):
        return {key: _plain(child, names) for key, child in node.values.items()}
    return names.get(node.place) or node.to_python()
