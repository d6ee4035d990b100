"""The order of execution: every block after the blocks whose outputs its own need."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from quadvis.graph.graph import Node

CONDITION = "condition"


def execution_order(nodes: Sequence[Node]) -> tuple[list[Node], list[list[tuple[str, str]]]]:
    """Return the nodes in an order that respects direct feedthrough, and the algebraic loops that forbid one.

    A loop is a list of (block, input) pairs, each input driven by the next block in the list; `CONDITION` in
    the place of an input stands for the condition under which the block runs. Blocks keep the diagram's order
    wherever the wires allow it.
    """
    by_path = {node.path: node for node in nodes}
    done: set[str] = set()
    order: list[Node] = []
    loops: list[list[tuple[str, str]]] = []
    # Each entry: a block, the input through which the search reached it, what it still needs.
    trail: list[tuple[str, str, Iterator[tuple[str, str]]]] = []
    active: dict[str, int] = {}

    def enter(path: str, port: str) -> None:
        active[path] = len(trail)
        trail.append((path, port, _needs(by_path[path])))

    for root in nodes:
        if root.path not in done:
            enter(root.path, "")
        while trail:
            path, _, needs = trail[-1]
            port, source = next(needs, ("", ""))
            if not port:
                trail.pop()
                del active[path]
                done.add(path)
                order.append(by_path[path])
            elif source in active:
                loop = trail[active[source] :]
                inputs = [entered for _, entered, _ in loop[1:]] + [port]
                loops.append([(entry[0], name) for entry, name in zip(loop, inputs, strict=True)])
            elif source in by_path and source not in done:
                enter(source, port)
    return order, loops


def _needs(node: Node) -> Iterator[tuple[str, str]]:
    """Yield what must be computed before this block: its feedthrough inputs and where they come from."""
    for port, wire in node.wires(node.block.interface.feedthrough):
        if not (wire.delayed or wire.earlier):
            yield port, wire.block
    if node.condition:
        yield CONDITION, node.condition
