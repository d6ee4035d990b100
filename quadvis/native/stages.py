"""A solver's formula as the numbers that compiled loops read."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from quadvis.engine.solver import TABLEAUS


def stage_numbers(solver: str, step: float) -> NDArray[np.float64]:
    """Return for each stage its node (s), and the weights of its slope for the next stage and the result.

    In all formulas of `TABLEAUS` a stage depends on the slope of the stage before it and on no other.
    """
    if solver not in TABLEAUS:
        return np.zeros((0, 3))  # the interpreter integrates
    tableau = TABLEAUS[solver]
    found = np.zeros((len(tableau.nodes), 3))
    for stage, (node, weights) in enumerate(zip(tableau.nodes, tableau.stages, strict=True)):
        assert not any(weights[:-1]), solver
        found[stage, 0] = node * step
        if stage:
            found[stage - 1, 1] = step * weights[-1]
    found[:, 2] = [step * weight for weight in tableau.weights]
    return found
