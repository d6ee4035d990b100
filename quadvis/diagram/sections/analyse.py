"""`analyse`: the questions of `quadvis analyse`: where to open the loop, and how far parameters can go."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from quadvis.diagram.draft import misfit
from quadvis.diagram.sections.context import Context, RunSection
from quadvis.diagram.sections.forms import QUANTITY, TEXT, Schema, closed, labelled, list_of, ref
from quadvis.diagram.times import read_duration
from quadvis.diagram.variable import Variable, find_variable
from quadvis.diagram.wiring import Wiring
from quadvis.document import YamlList, YamlMap, YamlNode, YamlScalar
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known
from quadvis.errors.caller import as_given
from quadvis.graph.names import wire_text
from quadvis.units import Unit, split_quantity

ANALYSE_KEYS = ("at", "cuts", "limits")
LIMIT_KEYS = ("vary", "from", "to")
AT = 3.0  # s, long enough for most queues to be full


class CutSignal(NamedTuple):
    """A signal, or some elements of it, counted as if it lay flat."""

    text: str
    block: str
    port: str
    elements: tuple[int, ...]


class Cut(NamedTuple):
    """A place where the loop is opened: one signal, or several at once."""

    label: str
    signals: tuple[CutSignal, ...]


class Limit(NamedTuple):
    """A question: how far a parameter can go from ``start`` toward ``end`` (SI) before the loop is unstable.

    ``shown`` is the unit that people read it in.
    """

    label: str
    variable: Variable
    start: float
    end: float
    shown: Unit

    def shows(self, value: float) -> str:
        """Return a value of the parameter as text."""
        number = f"{value / self.shown.scale:.4g}"
        return f"{number} {self.shown}" if self.shown.symbols else number


class Questions(NamedTuple):
    """All that is asked: time (s) of the operating point, cuts, limits; ``context`` is for more of them.

    ``named`` are the names that are written under `cuts` and under `limits`, also of those with a fault.
    """

    context: Context
    at: float = AT
    cuts: tuple[Cut, ...] = ()
    limits: tuple[Limit, ...] = ()
    named: tuple[tuple[str, ...] | Unknown, tuple[str, ...] | Unknown] = ((), ())

    def more(
        self, cuts: Mapping[str, Any], limits: Mapping[str, tuple[str, str, str]]
    ) -> tuple[tuple[Cut, ...], tuple[Limit, ...]]:
        """Return the cuts and limits with others added; DiagramError reports their faults."""
        added, sought = self.others(cuts, limits, as_given("--vary", "limits"))
        return self.cuts + added, self.limits + sought

    def others(
        self, cuts: Mapping[str, Any], limits: Mapping[str, tuple[str, str, str]], place: str
    ) -> tuple[tuple[Cut, ...], tuple[Limit, ...]]:
        """Return other cuts and limits alone; ``place`` names in faults where the limits were given."""
        faults = Faults()
        wiring = Wiring(self.context.wiring.expansion, faults)
        context = replace(self.context, wiring=wiring, faults=faults)
        for label in cuts:
            if any(label == cut.label for cut in self.cuts):
                problem = f"the diagram has a cut '{label}' already"
                faults.add(Place(as_given("--cut", "cuts")), problem, "choose another name")
        found = [_cut(label, _list(signals), context) for label, signals in cuts.items()]
        sought = [_limit(label, _map(limit, place), context) for label, limit in limits.items()]
        faults.check()
        return tuple(cut for cut in found if known(cut)), tuple(limit for limit in sought if known(limit))


class Analyse(RunSection[Questions]):
    """The questions that a diagram asks of its loop."""

    key = "analyse"
    words = "cut points and limits for `quadvis analyse`, see below"

    def read(self, node: YamlNode | None, context: Context) -> Questions:
        """Return the questions."""
        faults = context.faults
        if node is None:
            return Questions(context)
        fields = faults.collect(node.fields, (), ANALYSE_KEYS, faults)
        if fields is None:
            return Questions(context, named=(UNKNOWN, UNKNOWN))
        at = faults.collect(read_duration, fields["at"]) if "at" in fields else None
        cuts = faults.collect(fields["cuts"].mapping) if "cuts" in fields else None
        limits = faults.collect(fields["limits"].mapping) if "limits" in fields else None
        found = [_cut(key.value, value, context) for key, value in cuts.pairs()] if cuts else []
        sought = [_limit(key.value, value, context) for key, value in limits.pairs()] if limits else []
        return Questions(
            context,
            AT if at is None else float(at),
            tuple(cut for cut in found if known(cut)),
            tuple(limit for limit in sought if known(limit)),
            (_labels(fields.get("cuts")), _labels(fields.get("limits"))),
        )

    def schema(self) -> Schema:
        """Return the schema: a time, cuts and limits."""
        cut = {"anyOf": [ref("signal"), list_of(ref("signal"), "opened at once")]}
        return closed(ANALYSE_KEYS, {
            "at": {**QUANTITY, "description": "run so long before the operating point is sought"},
            "cuts": labelled(cut, "where `quadvis analyse` opens the loop, by name"),
            "limits": labelled(
                ref("limit"), "how far a parameter can go before the loop is unstable, by name"
            ),
        })  # fmt: skip

    def definitions(self, blocks: object) -> dict[str, Schema]:
        """Return the form of a limit."""
        limit: dict[str, Schema] = {
            "vary": {**TEXT, "description": "block.parameter, a parameter of the diagram, or an element"},
            "from": {**QUANTITY, "description": "where the search begins; the loop is stable there"},
            "to": {**QUANTITY, "description": "where it ends"},
        }
        return {"limit": closed(LIMIT_KEYS, limit, LIMIT_KEYS)}


def _labels(node: YamlNode | None) -> tuple[str, ...] | Unknown:
    if isinstance(node, YamlMap):
        return tuple(node.values)
    return UNKNOWN if node is not None else ()


def _text(text: str, place: str, key: str = "") -> YamlScalar:
    return YamlScalar(text, False, place, 0, 0, key)


def _list(signals: str | Sequence[str]) -> YamlNode:
    texts = [signals] if isinstance(signals, str) else list(signals)
    place = as_given("--cut", "cuts")
    return YamlList([_text(text, place) for text in texts], place, 0, 0)


def _map(limit: tuple[str, str, str], place: str) -> YamlMap:
    values: dict[str, YamlNode] = {
        key: _text(text, place, key) for key, text in zip(LIMIT_KEYS, limit, strict=True)
    }
    return YamlMap({}, values, place, 0, 0)


def _cut(label: str, node: YamlNode, context: Context) -> Cut | Unknown:
    """Read ``[control/heading.right, control/heading.right_velocity]`` or one signal."""
    items = node.values if isinstance(node, YamlList) else [node]
    if not items:
        problem, remedy = f"cut '{label}' has no signals", "name one, such as control/roll.torque"
        context.faults.add(node.place, problem, remedy)
    found = [_signal(item, context) for item in items]
    signals = tuple(signal for signal in found if known(signal))
    return Cut(label, signals) if signals and len(signals) == len(items) else UNKNOWN


def _signal(node: YamlNode, context: Context) -> CutSignal | Unknown:
    source, faults = context.wire(node), context.faults
    if source is UNKNOWN:
        return UNKNOWN
    found = context.nodes[source.block]
    declared = found.block.interface.outputs[source.port]
    if declared.signal.scalar != "float64":
        problem = f"'{source.source}' holds {declared.signal.scalar} values, which vary in no small steps"
        faults.add(node.place, problem, "open the loop at a signal of real numbers")
        return UNKNOWN
    if source.port not in found.units:
        return UNKNOWN
    shape = found.shape(source.port)
    try:
        flat = np.arange(math.prod(shape)).reshape(shape)[source.index]
    except IndexError:
        faults.add(node.place, misfit(source, shape), "count from 0" if shape else "leave it out")
        return UNKNOWN
    elements = tuple(int(element) for element in np.ravel(flat))
    return CutSignal(wire_text(source), source.block, source.port, elements)


def _limit(label: str, node: YamlNode, context: Context) -> Limit | Unknown:
    """Read ``{vary: eyes/camera.latency, from: 50 ms, to: 2 s}``."""
    faults = context.faults
    fields = faults.collect(node.fields, LIMIT_KEYS, (), faults)
    if fields is None or any(key not in fields for key in LIMIT_KEYS):
        return UNKNOWN
    variable = faults.collect(find_variable, context.wiring, context.graph, fields["vary"])
    if variable is None:
        return UNKNOWN
    start, end = (faults.collect(fields[key].quantity, variable.unit, bare=False) for key in LIMIT_KEYS[1:])
    if start is None or end is None:
        return UNKNOWN
    if start == end:
        faults.add(fields["to"].place, "'from' and 'to' are the same", "give the end of a range")
        return UNKNOWN
    unit = split_quantity(fields["to"].text())[1]
    return Limit(label, variable, start, end, Unit.parse(unit) if unit else variable.unit)


ANALYSE = Analyse()
