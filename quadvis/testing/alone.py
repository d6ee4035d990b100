"""One block alone in an engine, for unit tests and for the conformance suite."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np

from quadvis.block import Block, Sizes
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
    return Engine(Graph("alone", [node], solver, period if task.continuous else None), seed)


def parameter_sizes(block: Block) -> Sizes:
    """Return the symbolic sizes that a block's parameters fix."""
    sizes: Sizes = {}
    for param in block.interface.params.values():
        if not param.is_text:
            param.signal.unify(np.shape(getattr(block, param.name)), sizes)
    return sizes
