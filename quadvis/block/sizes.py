"""What follows for a block from its parameters and ports: symbolic sizes, and units of elements."""

from __future__ import annotations

import numpy as np

from quadvis.block.block import Block
from quadvis.block.declare import Declared
from quadvis.block.signals import Sizes
from quadvis.units import Unit


def parameter_sizes(block: Block) -> Sizes:
    """Return the symbolic sizes that a block's parameters fix, and the numbers of signals of its inputs.

    A size with the name of an input of any number, ``Derived("float64[u]")``, is the number of its signals.
    """
    sizes: Sizes = dict(block.entry_counts)
    for param in block.interface.params.values():
        if not param.is_text:
            param.signal.unify(np.shape(getattr(block, param.name)), sizes)
    return sizes


def units_of(declared: Declared, count: int) -> tuple[Unit, ...]:
    """Return one unit per element of a port with ``count`` elements; a single unit holds for all elements."""
    return declared.units * count if len(declared.units) == 1 else declared.units
