"""Parameters of a block that must have as many values as others, and have not."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.block.declare import ParameterError
from quadvis.errors import counted, sentence

if TYPE_CHECKING:
    from quadvis.block.block import Block


def unlike_sizes(block: Block) -> ParameterError | None:
    """Return what is wrong with the sizes of a block's parameters, which share names as in ``float64[n]``.

    The graph finds this, too, but a block checks its parameters before, and fails if they do not fit.
    """
    sizes: dict[str, Any] = {}
    first: dict[str, str] = {}
    for name, param in block.interface.params.items():
        shape = np.shape(getattr(block, name))
        if param.is_text or not param.signal.symbols:
            continue
        if not param.signal.unify(shape, sizes):
            other = next((first[each] for each in param.signal.symbols if each in first), "")
            if len(shape) != 1 or not other:
                return None
            values = counted(shape[0], "value"), counted(np.shape(getattr(block, other))[0], "value")
            problem = f"{name} has {values[0]}, and {other} has {values[1]}"
            return ParameterError(name, sentence(problem, "give as many of one as of the other"))
        first.update({each: first.get(each, name) for each in param.signal.symbols})
    return None
