"""The message of a link: the signals that some wires take, and their values before the first message."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from quadvis.block import NO_FRAME
from quadvis.diagram.draft import DraftWire
from quadvis.diagram.values import Bare, read_value, shape_text
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, known
from quadvis.graph.graph import Node, selected
from quadvis.links.insertion import signal_names
from quadvis.links.message import FRAME, Message, MessageSignal
from quadvis.units import Unit

ONE = Unit()


def report(faults: Faults, wire: DraftWire, place: Place, problem: str, remedy: str = "") -> None:
    """Report a fault of a wire, once: it may lead to several blocks of a part."""
    if not faults.reported(place):
        faults.add(place, problem, remedy, subject=f"block '{wire.draft.path}'")


def message_of(wires: Sequence[DraftWire], nodes: Mapping[str, Node], faults: Faults) -> Message | Unknown:
    """Return the message of the signals that some wires take, in the order of their names."""
    by_output: dict[tuple[str, str], list[DraftWire]] = {}
    for wire in wires:
        by_output.setdefault((wire.wire.block, wire.wire.port), []).append(wire)
    outputs = sorted(by_output)
    signals = [
        _signal(name, nodes[block], port, by_output[block, port], faults)
        for name, (block, port) in zip(signal_names(outputs), outputs, strict=True)
    ]
    found = tuple(signal for signal in signals if known(signal))
    return Message(found) if len(found) == len(signals) else UNKNOWN


def _signal(
    name: str, node: Node, port: str, wires: Sequence[DraftWire], faults: Faults
) -> MessageSignal | Unknown:
    declared, units = node.block.interface.outputs[port], node.units[port]
    scalar, shape = declared.signal.scalar, node.shape(port)
    asking = [wire for wire in wires if wire.connection.initial is not None]
    if scalar == FRAME:
        for wire in asking:
            assert wire.connection.initial is not None
            place = wire.connection.initial.place
            report(faults, wire, place, "a picture has no initial value", "leave 'initial' out")
        return MessageSignal(name, node.path, port, scalar, (), units, declared.nan, NO_FRAME)
    first = _FirstValue(
        np.full(shape, math.nan if declared.nan and scalar == "float64" else 0, scalar), units
    )
    if not all([first.take(wire, faults) for wire in asking]):
        return UNKNOWN
    value = first.value if shape else first.value.item()
    return MessageSignal(name, node.path, port, scalar, shape, units, declared.nan, value, bool(asking))


class _FirstValue:
    """The value of a signal before the first message: wires state some of its elements."""

    def __init__(self, value: Any, units: tuple[Unit, ...]) -> None:
        self.value, self.units = value, units
        self._said: dict[int, tuple[Any, Place]] = {}  # by element: the value, and where it is written

    def take(self, wire: DraftWire, faults: Faults) -> bool:
        """Take the value that a wire states; return whether it fits, and report it if it does not."""
        node = wire.connection.initial
        part = selected(self.value.shape, wire.wire.index)
        assert node is not None and part is not None
        read = faults.collect(read_value, wire.declared.signal, wire.declared.units, node)
        if read is None:
            return False
        found = np.asarray(read[0])
        problem, remedy = self._misfit(found, part, read[1]) or self._contradiction(found, part[0], wire)
        if problem:
            report(faults, wire, node.place, problem, remedy)
            return False
        for element, number in enumerate(found.ravel().tolist(), part[0]):
            self._said[element] = number, node.place
            self.value.reshape(-1)[element] = number
        return True

    def _misfit(self, found: Any, part: tuple[int, tuple[int, ...]], units: Any) -> tuple[str, str] | None:
        if found.shape != part[1]:
            problem = f"'initial' has {shape_text(found.shape)}, the wire {shape_text(part[1])}"
            return problem, "give one value for each element"
        for unit, wanted in zip(units, self.units[part[0] : part[0] + found.size], strict=False):
            given = ONE if isinstance(unit, Bare) else unit
            if given is not None and given.dimension != wanted.dimension:
                return f"'initial' is not in {wanted}, as the signal is", f"write it in {wanted}"
        return None

    def _contradiction(self, found: Any, first: int, wire: DraftWire) -> tuple[str, str]:
        for element, number in enumerate(found.ravel().tolist(), first):
            other = self._said.get(element, (number, None))
            if other[0] != number:
                problem = f"'{wire.wire.source}' begins with another value at {other[1]}"
                return problem, "write the same 'initial' for both, or use two links"
        return "", ""
