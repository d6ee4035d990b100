"""Signals that `expect`, `summary` and `figures` name, and the stretch of the run that counts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from fractions import Fraction
from typing import Any, Generic, NamedTuple, TypeVar

from quadvis.diagram.draft import misfit
from quadvis.diagram.requirements import Selection
from quadvis.diagram.sections.context import Context
from quadvis.diagram.sections.log import LOG
from quadvis.diagram.times import read_duration
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Unknown, known
from quadvis.graph.graph import Node, Wire, selected
from quadvis.graph.names import wire_text
from quadvis.output.stretch import Sampling, Stretch
from quadvis.units import Unit

STRETCH_KEYS = ("after", "before", "of")
DEGREE = Unit.parse("deg")

Item = TypeVar("Item")


@dataclass(frozen=True)
class Asked(Generic[Item]):
    """The items of a section, and the section as plain data with the full name of every signal."""

    items: tuple[Item, ...] = ()
    written: Any = None


class Signal(NamedTuple):
    """A signal that is logged, over the whole run, with its scalar kind."""

    selection: Selection
    scalar: str


def read_signal(node: YamlNode, context: Context) -> Signal | Unknown:
    """Return the signal that a section names."""
    wire = context.wire(node)
    return check_signal(node, wire, context) if known(wire) else UNKNOWN


def check_signal(node: YamlNode, wire: Wire, context: Context) -> Signal | Unknown:
    """Return a signal, which must be of numbers of one unit."""
    faults, name, found = context.faults, wire.source, context.nodes[wire.block]
    declared = found.block.interface.outputs[wire.port].signal
    if declared.scalar == "frame":
        faults.add(node.place, f"'{name}' is a picture, not a number", "name another signal")
        return UNKNOWN
    if wire.port not in found.units or any(symbol not in found.sizes for symbol in declared.symbols):
        if not faults:  # a requirement must never be left out in silence
            faults.add(node.place, f"the shape or the unit of '{name}' is not known", "wire its block")
        return UNKNOWN
    shape = found.shape(wire.port)
    try:
        part = selected(shape, wire.index)
    except IndexError:
        faults.add(node.place, misfit(wire, shape), "count from 0" if shape else "leave it out")
        return UNKNOWN
    if part is None:
        remedy = "take one element, or a run of them"
        faults.add(node.place, "the elements do not lie side by side", remedy)
        return UNKNOWN
    if wire.block not in context.values[LOG].paths:
        problem = f"block '{wire.block}' is not logged"
        faults.add(node.place, problem, f"add '{wire.block}' under 'log: {{signals: [...]}}'")
    units = set(found.units[wire.port][part[0] : part[0] + math.prod(part[1])])
    if len(units) > 1:
        problem = f"the elements of '{name}' have different units: {', '.join(sorted(map(str, units)))}"
        faults.add(node.place, problem, "take elements of one unit")
        return UNKNOWN
    unit = units.pop()
    shown = DEGREE if str(unit) == "rad" else unit
    stretch = Stretch(_sampling(found, context))
    text = wire_text(wire)
    return Signal(Selection(name, wire.index, text, unit, shown, 0.0, stretch, shape), declared.scalar)


def _sampling(node: Node, context: Context) -> Sampling:
    """Return when a block's outputs are recorded."""
    every = context.values[LOG].every.get(node.task.name, 1)
    return Sampling(node.task.offset, node.task.period * every, context.stop, context.shortened)


def read_stretch(fields: YamlMap, context: Context) -> Signal | Unknown:
    """Return the signal of an expectation or of a line of the summary, over its stretch of the run."""
    fields = context.filled(fields, STRETCH_KEYS)
    found = read_signal(fields["signal"], context) if "signal" in fields else UNKNOWN
    return in_stretch(found, fields, context)


def in_stretch(found: Signal | Unknown, fields: YamlMap, context: Context) -> Signal | Unknown:
    """Return a signal over the stretch of the run that some fields state."""
    after, before = (
        context.faults.collect(read_duration, fields[name]) if name in fields else None
        for name in STRETCH_KEYS[:2]
    )
    context.warn_window(fields, STRETCH_KEYS[:2], after, before)
    if found is UNKNOWN:
        return UNKNOWN
    selection = found.selection
    of = context.faults.collect(fields["of"].quantity, selection.unit, bare=False) if "of" in fields else None
    stretch = replace(selection.stretch, after=after or Fraction(0), before=before)
    return found._replace(selection=replace(selection, of=of or 0.0, stretch=stretch))
