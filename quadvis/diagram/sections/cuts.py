"""Signals that `quadvis analyse` opens or disturbs: cuts, and numbers of outputs and inputs."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from quadvis.block import Shape, SignalType
from quadvis.diagram.draft import misfit
from quadvis.diagram.sections.context import Context
from quadvis.document import YamlList, YamlNode
from quadvis.errors import UNKNOWN, Unknown, known
from quadvis.graph.graph import Node, Wire
from quadvis.graph.names import wire_text


class CutSignal(NamedTuple):
    """A signal, or some elements of it, counted as if it lay flat.

    ``port`` is an output of the block, or an input: the signal as this block alone reads it. Of an input of a
    part, ``block`` is the part, ``feed`` the wire that feeds it, and ``readers`` are the inputs of blocks in
    the part, (block, port), that read it.
    """

    text: str
    block: str
    port: str
    elements: tuple[int, ...]
    feed: Wire | None = None
    readers: tuple[tuple[str, str], ...] = ()


class Cut(NamedTuple):
    """A place where the loop is opened: one signal, or several at once.

    ``read_only`` says that its signals are never disturbed.
    """

    label: str
    signals: tuple[CutSignal, ...]
    read_only: bool = False


def read_cut(label: str, node: YamlNode, context: Context) -> Cut | Unknown:
    """Read ``[control/heading.right, control/heading.right_velocity]`` or one signal."""
    items = node.values if isinstance(node, YamlList) else [node]
    if not items:
        problem, remedy = f"cut '{label}' has no signals", "name one, such as control/roll.torque"
        context.faults.add(node.place, problem, remedy)
    found = [_output(item, context) for item in items]
    signals = tuple(signal for signal in found if known(signal))
    return Cut(label, signals) if signals and len(signals) == len(items) else UNKNOWN


def _output(node: YamlNode, context: Context) -> CutSignal | Unknown:
    source = context.wire(node)
    if source is UNKNOWN:
        return UNKNOWN
    found = context.nodes[source.block]
    signal = found.block.interface.outputs[source.port].signal
    if signal.scalar == "float64" and source.port not in found.units:
        return UNKNOWN
    return cut_signal(node, source, signal, found, context)


def cut_signal(
    node: YamlNode, named: Wire, signal: SignalType, found: Node, context: Context
) -> CutSignal | Unknown:
    """Return the elements of a port of a block that a text names; a fault if they are no real numbers."""
    return signal_of(node, named, signal.scalar, found.shape(named.port), context)


def signal_of(
    node: YamlNode, named: Wire, scalar: str, shape: Shape, context: Context
) -> CutSignal | Unknown:
    """Return the elements of a signal of this shape that a text names; a fault as above."""
    faults = context.faults
    if scalar != "float64":
        problem = f"'{named.source}' holds {scalar} values, which vary in no small steps"
        faults.add(node.place, problem, "open the loop at a signal of real numbers")
        return UNKNOWN
    try:
        flat = np.arange(math.prod(shape)).reshape(shape)[named.index]
    except IndexError:
        faults.add(node.place, misfit(named, shape), "count from 0" if shape else "leave it out")
        return UNKNOWN
    elements = tuple(int(element) for element in np.ravel(flat))
    return CutSignal(wire_text(named), named.block, named.port, elements)
