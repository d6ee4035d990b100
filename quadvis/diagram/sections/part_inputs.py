"""Inputs of parts as the ends of transfers: what feeds one, and what in the part reads it."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from quadvis.diagram.reference import Reference
from quadvis.diagram.scope import Scope
from quadvis.diagram.sections.context import Context
from quadvis.diagram.sections.cuts import CutSignal, signal_of
from quadvis.diagram.sections.ports import PORTS
from quadvis.document import YamlNode
from quadvis.errors import UNKNOWN, Unknown, known
from quadvis.graph.graph import Wire


def part_input(node: YamlNode, reference: Reference, context: Context) -> CutSignal | Unknown | None:
    """Return the input of a part that a name means; None if it names none, or an output of that name.

    A fault, if no signal feeds it, if nothing reads it, or if another input of the part has the same signal.
    """
    scope = _part(context.wiring.expansion.root, reference.block)
    if scope is None or reference.port not in {*scope.spec[PORTS].inputs} - {*scope.spec[PORTS].outputs}:
        return None
    name, faults = f"{reference.block}.{reference.port}", context.faults
    feeds = dict(context.wiring.entries())
    feed = feeds.get(name)
    if feed is None or feed.block not in context.nodes:
        if context.is_whole:
            faults.add(node.place, f"no signal feeds '{name}'", "name an input that is wired to a block")
        return UNKNOWN
    mine = {key: wire for key, wire in feeds.items() if key.rpartition(".")[0] == reference.block}
    others = [wire for key, wire in mine.items() if key != name]
    readers = list(_readers(scope, feed, context))
    if any(_carries(other, wire) for other in others for _, _, wire in readers):
        problem = f"another input of '{reference.block}' has the signal of '{name}', too"
        faults.add(node.place, problem, "name the input of a block in the part")
        return UNKNOWN
    if not readers:
        faults.add(node.place, f"nothing in the part reads '{name}'", "name another input")
        return UNKNOWN
    producer = context.nodes[feed.block]
    if feed.port not in producer.units:
        return UNKNOWN
    whole = producer.shape(feed.port)
    shape = np.arange(math.prod(whole)).reshape(whole)[feed.index].shape
    scalar = producer.block.interface.outputs[feed.port].signal.scalar
    found = signal_of(node, Wire(reference.block, reference.port, reference.index), scalar, shape, context)
    ends = tuple((path, port) for path, port, _ in readers)
    return found._replace(feed=feed, readers=ends) if known(found) else UNKNOWN


def _part(scope: Scope, path: str) -> Scope | None:
    """Return the part with this path."""
    for part in scope.parts:
        if part.prefix == f"{path}/":
            return part
        if path.startswith(part.prefix):
            return _part(part, path)
    return None


def _readers(scope: Scope, feed: Wire, context: Context) -> Iterator[tuple[str, str, Wire]]:
    """Yield the inputs of blocks in a part that read what feeds it, and their wires."""
    for path, node in context.nodes.items():
        if path.startswith(scope.prefix):
            yield from ((path, port, wire) for port, wire in node.wires() if _carries(feed, wire))


def _carries(feed: Wire, wire: Wire) -> bool:
    """Say whether the wire of a reader may come from an input with this feed; no name has two indexes."""
    same = (feed.block, feed.port) == (wire.block, wire.port)
    return same and feed.index in ((), wire.index)
