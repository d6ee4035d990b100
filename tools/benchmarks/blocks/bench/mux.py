"""A vector out of four scalars."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out


class Mux(Block):
    """Four scalars as one vector."""

    u0, u1, u2, u3 = In(), In(), In(), In()
    y0 = Out("float64[4]")

    def output(self, u0: float, u1: float, u2: float, u3: float) -> Any:
        """Return the vector."""
        return np.array((u0, u1, u2, u3))
