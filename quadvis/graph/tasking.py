"""Transitions between tasks that run each by itself, as Simulink's multitasking mode has them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from quadvis.graph.graph import Node, Task, rank


def with_transitions(nodes: Iterable[Node]) -> None:
    """Make wires between tasks deterministic where each task runs by itself and faster ones interrupt it.

    As Simulink's rate transitions do: from a slower task a faster one reads what the slower gave one of the
    slower's periods ago, swapped when the slower is due again, since its present value may not be ready.
    From a faster task a slower one reads what the faster gave when the slower became due; the value is
    latched, since the faster runs on meanwhile. So is a late value, unless the fastest task of all reads it
    and is always through before it changes: that task runs where late values are swapped.
    """
    nodes = list(nodes)
    tasks = {node.path: node.task for node in nodes}
    fastest = min(tasks.values(), key=rank, default=None)
    for node in nodes:
        for port, wire in list(node.wires()):
            producer, reader = tasks.get(wire.block, node.task), node.task
            if producer != reader and not wire.earlier:
                late = not wire.delayed and rank(producer) > rank(reader)
                through = (late or wire.delayed) and reader == fastest and _falls_on(producer, reader)
                node.inputs[port] = replace(wire, late=late, latched=not through)


def _falls_on(task: Task, other: Task) -> bool:
    """Return whether every tick of a task is one of another, from the later offset on."""
    return task.period % other.period == 0 and (task.offset - other.offset) % other.period == 0
