"""Which tasks can hold each other up although each runs by itself: those that share Python's interpreter."""

from __future__ import annotations

from collections.abc import Collection

from quadvis.errors import counted
from quadvis.graph.graph import Graph

SHOWN = 3  # blocks of a task in a message


def hold_ups(graph: Graph, interpreted: Collection[str]) -> list[str]:
    """Return a sentence for each task with blocks that are ``interpreted``, given by their paths.

    Only one thread at a time can run Python.
    """
    blocks = {task.name: [] for task in graph.tasks}  # type: dict[str, list[str]]
    for node in graph.nodes:
        if node.path in interpreted:
            blocks[node.task.name].append(node.path)
    python = [name for name, paths in blocks.items() if paths]
    return [_sentence(name, blocks[name], [other for other in python if other != name]) for name in python]


def _sentence(name: str, paths: list[str], others: list[str]) -> str:
    more = f" and {counted(len(paths) - SHOWN, 'other')}" if len(paths) > SHOWN else ""
    what = f"task '{name}' runs Python ({', '.join(paths[:SHOWN])}{more})"
    if not others:
        return f"{what}; it holds up no other task"
    *first, last = (f"'{each}'" for each in others)
    tasks = f"{', '.join(first)} and {last}" if first else last
    return f"{what} and can hold up {tasks}, which {'do' if first else 'does'} so, too"
