"""One block alone in an engine, for unit tests and for the conformance suite."""

from __future__ import annotations

import functools
import os
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

from quadvis.block import CABLE, Block, Input, Sizes
from quadvis.engine.engine import Engine
from quadvis.graph.graph import Constant, Graph, Node, Task

ALONE = "block"  # the path of the block


def alone(
    block: Block,
    inputs: Mapping[str, Any],
    sizes: Sizes,
    period: Fraction,
    solver: str = "ode4",
    seed: int = 0,
) -> Engine:
    """Return an engine that runs one block; the block's inputs hold ``inputs`` until they are written."""
    task = Task("alone", period, continuous=bool(block.interface.continuous))
    constants = {name: Constant(value) for name, value in inputs.items()}
    node = Node(ALONE, type(block).__name__, block, task, dict(constants), sizes)
    made = Engine(Graph("alone", [node], solver, period if task.continuous else None), seed)
    if isinstance(block, Input) and block.port_given.startswith(CABLE):
        made.bound(ALONE).actual_port = _silent_port()
    return made


@functools.cache
def _silent_port() -> str:
    """Return a port to which nothing ever comes, in the place of a cable."""
    return os.ttyname(os.openpty()[1])
