"""`figures`: the pictures of a run that `quadvis plot` draws.

    figures:
      - title: Position estimate           # in lower case also the name of the file
        from: 40 s                         # stretch of the run; the whole run if absent
        to: 140 s
        panels:                            # side by side, three in a row
          - title: x
            signals:
              - plant.position[0]          # a signal, an element [2,1], or elements [0:2]
              - {signal: "vision/pose.position[0]", label: camera}
            unit: cm                       # of the axis; the unit of the first signal if absent
            reference: 0                   # dashed line; the legend has the RMS of the distance from it
          - signals: plant.position[1]
            against: plant.position[0]     # what lies across in place of the time: a picture in the plane
      - title: Yaw angle                   # a figure of one panel may have the panel's keys
        signals: plant.attitude[2]
        unit: deg

A reference is in the unit of the axis, or brings its own ("4 cm"). It may be a parameter of the diagram,
"$target[2]", and so may times. In YAML's flow style a signal with an index needs quotes. Only a title and
signals are required.
"""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

from quadvis.diagram.reference import read_reference
from quadvis.diagram.sections.context import Context, RunSection
from quadvis.diagram.sections.forms import QUANTITY, SIGNAL, TEXT, Schema, closed, list_of, ref
from quadvis.diagram.sections.section import Checked
from quadvis.diagram.sections.signals import Asked, check_signal
from quadvis.diagram.times import SECOND
from quadvis.diagram.unit_flow import words
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar, parse_yaml
from quadvis.errors import UNKNOWN, DiagramError, Fault, Faults, Place, Unknown, known, quoted
from quadvis.errors.rules import ANGLES, ruled
from quadvis.graph.graph import Wire
from quadvis.output.figures import Figure, Panel, Trace
from quadvis.output.stretch import NANOSECONDS, stamp
from quadvis.units import Unit, UnitError, split_quantity

STRETCH_KEYS = ("from", "to")
PANEL_KEYS = ("signals", "title", "unit", "reference", "against")
TRACE_KEYS = ("signal", "label")
FIGURE_KEYS = ("title", *STRETCH_KEYS, "panels", "signals", "unit", "reference", "against")


class Figures(RunSection[Asked[Figure]]):
    """The figures of a run."""

    key = "figures"
    words = (
        "what `quadvis plot` draws: `{title, from, to, panels: [{title, signals, unit, reference, against}]}`"
    )

    def read(self, node: YamlNode | None, context: Context) -> Asked[Figure]:
        """Return the figures in the order of the file."""
        figures = FigureReader(context.faults, context).figures(node) if node is not None else []
        return Asked(tuple(figures), context.written(node))

    def schema(self) -> Schema:
        """Return the schema: a list of figures."""
        return list_of(ref("figure"), "what `quadvis plot` draws")

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the forms of a panel and of a figure."""
        label = {**TEXT, "description": "in the legend"}
        trace = closed(TRACE_KEYS, {"signal": SIGNAL, "label": label}, ["signal"])
        panel: dict[str, Schema] = {
            "signals": {"anyOf": [SIGNAL, list_of({"anyOf": [SIGNAL, trace]}, "curves of the panel")]},
            "title": TEXT,
            "unit": {**TEXT, "description": "of the axis; that of the first signal if absent"},
            "against": {"anyOf": [SIGNAL, trace], "description": "lies across in place of the time"},
            "reference": {**QUANTITY, "description": "dashed line from which the RMS in the legend counts"},
        }
        figure = panel | {
            "from": {**QUANTITY, "description": "stretch of the run, such as 40 s"},
            "to": QUANTITY,
            "panels": list_of(ref("panel"), "side by side, three in a row"),
        }
        either = {"oneOf": [{"required": ["panels"]}, {"required": ["signals"]}]}
        return {
            "panel": closed(PANEL_KEYS, panel, ["signals"]),
            "figure": {**closed(FIGURE_KEYS, figure, ["title"]), **either},
        }

    def resolved(self, diagram: Checked) -> Any:
        """Return the figures as they are written, with the full names of signals."""
        return diagram.values[self].written


def read_figures(text: str, file: str) -> list[Figure]:
    """Return the figures of a resolved diagram, as a log keeps it; DiagramError if they are wrong there."""
    faults = Faults()
    root = parse_yaml(text, file) if text.strip() else None
    node = root.get(FIGURES.key) if isinstance(root, YamlMap) else None
    figures = FigureReader(faults).figures(node) if node is not None else []
    faults.check()
    return figures


class FigureReader:
    """Reads figures; with a context their signals are looked up, and must fit the unit of their panel."""

    def __init__(self, faults: Faults, context: Context | None = None) -> None:
        self.faults, self.context = faults, context

    def figures(self, node: YamlNode) -> list[Figure]:
        """Return the figures under `figures:`."""
        entries = self.faults.collect(node.items) or []
        figures = (self.faults.collect(self._figure, entry) for entry in entries)
        return [figure for figure in figures if figure]

    def _figure(self, node: YamlNode) -> Figure:
        single = "panels" not in node.mapping()
        keys = [key for key in PANEL_KEYS if key != "title"] if single else ["panels"]
        entry = node.fields(("title", keys[0]), (*STRETCH_KEYS, *keys[1:]), self.faults)
        title = entry.get("title")
        name = self.faults.collect(title.text) if title else None
        panels = [entry] if single else self.faults.collect(_some, entry["panels"]) or []
        read = [self.faults.collect(self._panel, panel, single) for panel in panels]
        if self.context is not None:
            entry = self.context.filled(entry, STRETCH_KEYS)
        begin, end = (self._time(entry.get(key)) for key in STRETCH_KEYS)
        start = stamp(begin) / NANOSECONDS if begin is not None else -math.inf
        stop = stamp(end) / NANOSECONDS if end is not None else math.inf
        if start >= stop:
            self.faults.add(entry["to"].place, "'to' must come after 'from'")
        if self.context is not None:
            self.context.warn_window(entry, STRETCH_KEYS, begin, end)
        return Figure(name or "figure", tuple(panel for panel in read if panel), start, stop)

    def _time(self, node: YamlNode | None) -> Fraction | None:
        if node is None or self.faults.collect(node.quantity, SECOND, bare=False) is None:
            return None
        return node.exact(SECOND)

    def _panel(self, node: YamlNode, single: bool) -> Panel:
        """Read a panel; in a figure of one panel the keys and the title are the figure's."""
        entry = node.mapping() if single else node.fields(PANEL_KEYS[:1], PANEL_KEYS[1:], self.faults)
        place = entry["reference"].place if "reference" in entry else entry.place
        if self.context is not None:
            entry = self.context.filled(entry, ("reference",))
        title, signals, unit, reference = map(entry.get, ("title", "signals", "unit", "reference"))
        shown = self.faults.collect(_unit, unit) if unit else None
        entries = _some(signals) if isinstance(signals, YamlList) else [signals] if signals else []
        traces = [self.faults.read(self._trace, trace, shown) for trace in entries]
        level = self.faults.collect(_level, reference, unit, shown, place) if reference else None
        name = self.faults.collect(title.text) if title and not single else None
        over = self.faults.read(self._trace, entry["against"], None) if "against" in entry else None
        against = over if over is not None and known(over) else None
        return Panel(tuple(trace for trace in traces if known(trace)), name or "", shown, level, against)

    def _trace(self, node: YamlNode, shown: Unit | None) -> Trace | Unknown:
        label = None
        if isinstance(node, YamlMap):
            entry = node.fields(TRACE_KEYS[:1], TRACE_KEYS[1:])
            node, label = entry["signal"], entry.get("label")
        reference = read_reference(node, self.faults)
        if reference is UNKNOWN:
            return UNKNOWN
        wire: Wire | Unknown = Wire(reference.block, reference.port, reference.index)
        if self.context is not None:
            wire = self.context.source(reference)
            if known(wire):
                self._check(node, wire, shown, self.context)
        return Trace(wire, label.text() if label else "") if known(wire) else UNKNOWN

    def _check(self, node: YamlNode, wire: Wire, shown: Unit | None, context: Context) -> None:
        found = check_signal(node, wire, context)
        if not known(found) or shown is None:
            return
        text, unit = found.selection.text, found.selection.unit
        if not shown.dimension_equals(unit):
            problem = f"'{text}' has {words(unit)}, the panel is in {words(shown)}"
            rule = ANGLES if (unit / shown).is_angle else ""
            self.faults.add(node.place, problem, ruled("give it a panel of its own", rule))


def _some(node: YamlNode) -> list[YamlNode]:
    """Return the entries of a list, which must not be empty."""
    if not node.items():
        raise node.fault("the list is empty", "write its entries, or leave the key out")
    return node.items()


def _level(node: YamlNode, unit: YamlNode | None, shown: Unit | None, place: Place) -> float:
    """Return a reference in the unit of the axis; ``place`` is where the panel names it."""
    if unit is None and isinstance(node, YamlScalar) and all(split_quantity(node.value)):
        problem = f"the reference is {quoted(node.value)}, and its panel has no unit"
        raise DiagramError([Fault(place, "", problem, "add the 'unit' of the axis")])
    return node.quantity(shown or Unit())


def _unit(node: YamlNode) -> Unit:
    try:
        return Unit.parse(node.text())
    except UnitError as error:
        raise node.fault(error.problem, error.remedy) from None


FIGURES = Figures()
