"""`transfer` under `analyse`: the way from one number of a signal to another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from quadvis.block import entry_name
from quadvis.diagram.reference import Reference, read_reference
from quadvis.diagram.sections.context import Context
from quadvis.diagram.sections.cuts import Cut, CutSignal, cut_signal, read_cut
from quadvis.diagram.sections.forms import Schema, closed, list_of, ref
from quadvis.diagram.sections.part_inputs import part_input
from quadvis.document import YamlList, YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Unknown, known
from quadvis.graph.graph import Node, Wire, selected
from quadvis.units import Unit

TRANSFER_KEYS = ("from", "to", "open")
EXAMPLE = "write [from, to], such as [speed.y, motor.y], or {from: ..., to: ..., open: ...}"


class Transfer(NamedTuple):
    """A question: how the signal ``target`` answers a disturbance that is added to the signal ``source``.

    Each is one number. An output is disturbed for all its readers, and read as its block gives it, without
    the disturbance; an input is disturbed for its block or part alone, and read with it. ``opened`` are
    signals whose readers get what they get at the operating point: there the loop is open. ``unit`` is that
    of the answer over the disturbance.
    """

    label: str
    source: CutSignal
    target: CutSignal
    opened: tuple[CutSignal, ...] = ()
    unit: Unit = Unit()

    @property
    def text(self) -> str:
        """The way in words."""
        way = f"{self.source.text} to {self.target.text}"
        opened = ", ".join(signal.text for signal in self.opened)
        return f"{way}, open at {opened}" if opened else way


def read_transfer(label: str, node: YamlNode, context: Context) -> Transfer | Unknown:
    """Read ``[speed.y, motor.y]`` or ``{from: speed.y, to: motor.y, open: motor.y}``."""
    faults, opened = context.faults, None
    if isinstance(node, YamlMap):
        fields = faults.collect(node.fields, TRANSFER_KEYS[:2], TRANSFER_KEYS[2:], faults)
        if fields is None or any(key not in fields for key in TRANSFER_KEYS[:2]):
            return UNKNOWN
        ends = [fields["from"], fields["to"]]
        opened = read_cut(label, fields["open"], context) if "open" in fields else None
    else:
        ends = list(node.values) if isinstance(node, YamlList) else []
    if len(ends) != 2:
        faults.add(node.place, f"transfer '{label}' goes from one signal to another one", EXAMPLE)
        return UNKNOWN
    source, target = (_end(end, context) for end in ends)
    if not known(source) or not known(target) or opened is UNKNOWN:
        return UNKNOWN
    unit = _unit(target, context) / _unit(source, context)
    return Transfer(label, source, target, opened.signals if isinstance(opened, Cut) else (), unit)


def transfer_schema() -> Schema:
    """Return the forms of a transfer."""
    words = {"from": "where a disturbance is added: an output or an input", "to": "what answers it"}
    ends: dict[str, Schema] = {key: {**ref("signal"), "description": text} for key, text in words.items()}
    opened = {"anyOf": [ref("signal"), list_of(ref("signal"), "opened at once")]}
    pair = {**list_of(ref("signal"), "from, to"), "minItems": 2, "maxItems": 2}
    return {"anyOf": [pair, closed(TRANSFER_KEYS, {**ends, "open": opened}, TRANSFER_KEYS[:2])]}


def _end(node: YamlNode, context: Context) -> CutSignal | Unknown:
    """Return the one number that a text names."""
    reference = read_reference(node, context.faults)
    if reference is UNKNOWN:
        return UNKNOWN
    reader, entry = _input(reference, context), part_input(node, reference, context)
    if entry is not None:
        found = entry
    elif reader is None:
        cut = read_cut("", node, context)
        found = cut.signals[0] if known(cut) else UNKNOWN
    else:
        wire, block = reader
        found = cut_signal(node, wire, block.block.interface.inputs[wire.port].signal, block, context)
    if known(found) and len(found.elements) != 1:
        remedy = f"choose one, such as {found.block}.{found.port}[0]"
        context.faults.add(node.place, f"'{found.text}' has {len(found.elements)} numbers", remedy)
        return UNKNOWN
    return found


def _input(reference: Reference, context: Context) -> tuple[Wire, Node] | None:
    """Return the input that a name means, and its block; None if it names no input of a block."""
    block = context.nodes.get(reference.block)
    if block is None:
        return None
    port, index = reference.port, reference.index
    if port not in block.inputs and index and isinstance(index[0], int):  # one of any number of inputs
        port, index = entry_name(port, index[0]), index[1:]
    return (Wire(block.path, port, index), block) if port in block.inputs else None


def _unit(signal: CutSignal, context: Context) -> Unit:
    """Return the unit of a number; that of an input is the unit of what comes in, if it is known."""
    if signal.feed is not None:
        return _of_feed(signal.feed, signal.elements[0], context)
    block = context.nodes[signal.block]
    units, place = block.units.get(signal.port, ()), signal.elements[0]
    if signal.port in block.inputs:
        wire = block.inputs[signal.port]
        if isinstance(wire, Wire):
            return _of_feed(wire, place, context)
        units = block.block.interface.inputs[signal.port].units
    return _at(units, place)


def _of_feed(wire: Wire, place: int, context: Context) -> Unit:
    """Return the unit of a number of what a wire carries."""
    producer = context.nodes[wire.block]
    part = selected(producer.shape(wire.port), wire.index)
    return _at(producer.units.get(wire.port, ()), place + (part[0] if part else 0))


def _at(units: Sequence[Unit], place: int) -> Unit:
    unit = units[place if len(units) > 1 else 0] if units else Unit()
    return Unit() if unit.variables else unit
