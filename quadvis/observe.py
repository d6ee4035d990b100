"""What a diagram makes of a run: its sections `log`, `expect`, `summary` and `figures`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING, Any

from quadvis.document import Mapping as Fields
from quadvis.document import Node
from quadvis.errors import Faults, suggestion
from quadvis.graph import Graph, Wire, selected
from quadvis.loader import SECOND, index_text, read_duration, read_reference
from quadvis.units import Unit
from quadvis.verdict import EXPECTATIONS, STATISTICS, Entry, Expectation, Outcome, Part, Signals

if TYPE_CHECKING:
    from quadvis.expand import Expansion

ONE = Unit()


@dataclass
class Observation:
    """``logged`` are the paths of the blocks that are recorded, ``every`` the decimation by task."""

    logged: list[str] = field(default_factory=list)
    every: dict[str, int] = field(default_factory=dict)
    expectations: list[Expectation] = field(default_factory=list)
    summary: list[Entry] = field(default_factory=list)
    figures: list[dict[str, Any]] = field(default_factory=list)  # plain data, signals by their full names
    sections: dict[str, Any] = field(default_factory=dict)  # the others as plain data, likewise

    def judge(self, signals: Signals) -> Outcome:
        """Return the summary and the verdicts of a run."""
        summary = {entry.label: entry.compute(signals) for entry in self.summary}
        return Outcome(summary, tuple(expectation.judge(signals) for expectation in self.expectations))


def read_observation(
    sections: Mapping[str, Node], expansion: Expansion, graph: Graph, faults: Faults
) -> Observation:
    """Read the sections against the blocks that there are; faults are collected."""
    reader = _Reader(expansion, graph, faults)
    if "log" in sections:
        reader.log(sections["log"])
    else:
        reader.result.logged = [node.path for node in graph.nodes]
    for name, read in (("expect", reader.expectation), ("figures", reader.figure)):
        items = faults.collect(sections[name].items) if name in sections else None
        for item in items or []:
            with faults.about(name):
                read(item)
    entries = faults.collect(sections["summary"].mapping) if "summary" in sections else None
    for key, item in entries.pairs() if entries is not None else []:
        with faults.about("summary"):
            reader.entry(key.value, item)
    reader.check_logged()
    return reader.result


@dataclass(frozen=True)
class _Signal:
    part: Part
    units: tuple[Unit, ...]
    scalar: str

    @property
    def unit(self) -> Unit:
        """The unit of the elements if they share one."""
        return self.units[0] if len(set(self.units)) == 1 else ONE


class _Reader:
    def __init__(self, expansion: Expansion, graph: Graph, faults: Faults) -> None:
        self.expansion, self.faults = expansion, faults
        self.nodes = {node.path: node for node in graph.nodes}
        self.result = Observation()
        self.wanted: dict[str, Node] = {}

    def log(self, node: Node) -> None:
        """Read which blocks are logged, and how often: ``{signals: ["**"], every: {continuous: 4}}``."""
        fields = self.faults.collect(node.fields, (), ("signals", "every"), self.faults)
        if fields is None:
            return
        patterns = self.faults.collect(fields["signals"].items) if "signals" in fields else None
        if patterns is None:
            self.result.logged = list(self.nodes)
        for pattern in patterns or []:
            text = self.faults.collect(pattern.text) or ""
            found = [path for path in self.nodes if fnmatchcase(path, text)]
            if not found:
                remedy = suggestion(text, self.nodes) or "write a block, or a pattern such as 'vision/*'"
                self.faults.add(pattern.place, f"no block matches '{text}'", remedy)
            self.result.logged += [path for path in found if path not in self.result.logged]
        tasks = {node.task.name for node in self.nodes.values()}
        every = self.faults.collect(fields["every"].mapping) if "every" in fields else None
        for key, value in every.pairs() if every is not None else []:
            count = self.faults.collect(value.integer)
            if key.value not in tasks:
                self.faults.add(key.place, f"there is no rate '{key.value}' in use", suggestion(key.value, tasks))
            elif count is not None and count < 1:
                self.faults.add(value.place, "a row cannot be kept more often than it comes", "write 1 or more")
            elif count is not None:
                self.result.every[key.value] = count

    def check_logged(self) -> None:
        """Whatever is judged or drawn must be logged."""
        for path, node in self.wanted.items():
            if path not in self.result.logged:
                self.faults.add(node.place, f"block '{path}' is not logged", "add it under 'log: {signals: [...]}'")

    def _signal(self, node: Node, fields: Fields | None = None) -> _Signal | None:
        reference = read_reference(node, self.faults)
        if reference is None:
            return None
        source = self.expansion.find(self.expansion.root, reference).source
        if not isinstance(source, Wire) or source.block in self.expansion.unknown:
            return None
        found = self.nodes.get(source.block)
        if found is None:
            self.faults.add(node.place, f"there is no block '{source.block}'", suggestion(source.block, self.nodes))
            return None
        outputs = {name: port for name, port in found.block.interface.outputs.items() if port.type != "frame"}
        if source.port not in outputs:
            remedy = suggestion(source.port, outputs) or "it has none"
            self.faults.add(node.place, f"block '{source.block}' has no signal '{source.port}'", remedy)
            return None
        port = outputs[source.port]
        shape = found.shape(source.port)
        try:
            part = selected(shape, source.index)
        except IndexError:
            self.faults.add(node.place, f"'{source.source}' has {math.prod(shape)} elements", "count from 0")
            return None
        if part is None:
            self.faults.add(node.place, "this part does not lie in one piece", "take an element, or a run of them")
            return None
        self.wanted.setdefault(source.block, node)
        units = found.units[source.port][part[0] : part[0] + math.prod(part[1])]
        unit = str(units[0]) if len(set(units)) == 1 else "1"
        after, before = self._stretch(fields)
        text = source.source + index_text(source.index)
        return _Signal(Part(source.source, source.index, text, unit, after, before), units, port.signal.scalar)

    def _stretch(self, fields: Fields | None) -> tuple[float, float]:
        limits = [0.0, math.inf]
        for position, name in enumerate(("after", "before")):
            if fields is not None and name in fields:
                value = read_duration(fields[name], self.faults)
                limits[position] = limits[position] if value is None else float(value)
        return limits[0], limits[1]

    def expectation(self, node: Node) -> None:
        """Read ``{signal: plant.position[0], after: 20 s, within: 0.15 m}``."""
        optional = ("after", "before", "of", *EXPECTATIONS)
        fields = self.faults.collect(node.fields, ("signal",), optional, self.faults)
        if fields is None or "signal" not in fields:
            return
        signal = self._signal(fields["signal"], fields)
        kinds = [kind for kind in EXPECTATIONS if kind in fields]
        if not kinds:
            self.faults.add(node.place, "nothing is expected of the signal", f"add one of {', '.join(EXPECTATIONS)}")
        if signal is None:
            return
        of = self.faults.collect(fields["of"].quantity, signal.unit, bare=False) if "of" in fields else 0.0
        for kind in kinds:
            unit = ONE if kind == "count" else signal.unit
            limit = self.faults.collect(fields[kind].quantity, unit, bare=False)
            if limit is not None:
                self.result.expectations.append(Expectation(signal.part, kind, limit, of or 0.0))
                self._keep("expect", {**fields.to_python(), "signal": signal.part.text}, node)

    def entry(self, label: str, node: Node) -> None:
        """Read a line of the summary: ``x: {signal: plant.position[0], after: 40 s, show: [rms, max], unit: cm}``."""
        if not isinstance(node, Fields):
            node = Fields({}, {"signal": node}, node.file, node.line, node.column)
        fields = self.faults.collect(node.fields, ("signal",), ("after", "before", "show", "unit"), self.faults)
        if fields is None or "signal" not in fields:
            return
        signal = self._signal(fields["signal"], fields)
        names = self.faults.collect(fields["show"].items) if "show" in fields else None
        show = [self.faults.collect(name.choice, STATISTICS) for name in names or []]
        unit = self.faults.collect(fields["unit"].unit) if "unit" in fields else None
        if signal is None or None in show:
            return
        if unit is not None and not unit.dimension_equals(signal.unit):
            self.faults.add(fields["unit"].place, f"'{signal.part.text}' is in {signal.unit}, not in {unit}")
            return
        default = ("rms", "max") if signal.scalar == "float64" else ("count",)
        shown = tuple(name for name in show if name) or default
        unit = unit or signal.unit
        if signal.scalar != "float64":
            unit = ONE
        self.result.summary.append(Entry(label, signal.part, shown, str(unit), unit.scale))
        self._keep("summary", {label: {**fields.to_python(), "signal": signal.part.text}}, node)

    def _keep(self, section: str, plain: Any, _: Node) -> None:
        if section == "summary":
            self.result.sections.setdefault(section, {}).update(plain)
        elif plain not in self.result.sections.setdefault(section, []):
            self.result.sections[section].append(plain)

    def figure(self, node: Node) -> None:
        """Read one figure; see ``quadvis.plot`` for what it draws."""
        fields = self.faults.collect(node.fields, ("title", "panels"), ("from", "to"), self.faults)
        if fields is None or "panels" not in fields:
            return
        for name in ("from", "to"):
            if name in fields:
                self.faults.collect(fields[name].exact, SECOND)
        plain = {key: fields[key].to_python() for key in fields if key != "panels"}
        panels = self.faults.collect(fields["panels"].items) or []
        plain["panels"] = [panel for panel in map(self._panel, panels) if panel is not None]
        self.result.figures.append(plain)

    def _panel(self, node: Node) -> dict[str, Any] | None:
        optional = ("title", "unit", "reference", "label")
        fields = self.faults.collect(node.fields, ("signals",), optional, self.faults)
        if fields is None or "signals" not in fields:
            return None
        plain = {key: fields[key].to_python() for key in fields if key != "signals"}
        unit = self.faults.collect(fields["unit"].unit) if "unit" in fields else None
        plain["signals"] = []
        for item in self.faults.collect(fields["signals"].items) or []:
            name = item
            label = None
            if isinstance(item, Fields):
                trace = self.faults.collect(item.fields, ("signal",), ("label",), self.faults)
                if trace is None or "signal" not in trace:
                    continue
                name = trace["signal"]
                label = self.faults.collect(trace["label"].text) if "label" in trace else None
            signal = self._signal(name)
            if signal is None:
                continue
            if unit is not None and not unit.dimension_equals(signal.unit):
                self.faults.add(name.place, f"'{signal.part.text}' is in {signal.unit}, the panel in {unit}")
            plain["signals"].append({"signal": signal.part.text, "label": label} if label else signal.part.text)
        return plain
