"""The parameters of continuous systems that a block may compute at a rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.block import Block, Param, ParameterError
from quadvis_blocks.systems._files import Matrices
from quadvis_blocks.systems._models import Model
from quadvis_blocks.systems._sampling import CONTINUOUS, DISCRETE, MATCHED, METHODS, TUSTIN, WORDS, sampled

if TYPE_CHECKING:
    _Base = Block
else:  # `Sampled` alone is not a block: it has no model
    _Base = object


class Sampled(_Base):
    """How a block computes a continuous system."""

    method = Param("continuous", choices=METHODS, doc=WORDS)
    prewarp = Param(0.0, unit="rad/s", min=0.0, doc="frequency that ``method: tustin`` keeps; 0 is none")

    def suits(self, held: Matrices) -> None:
        """Refuse a file with a sampled system, as its ``dt`` (s) says, unless it is one of this period."""
        period = float(held["dt"].flat[0]) if "dt" in held else 0.0
        if period <= 0.0:
            return
        if self.method != DISCRETE:
            problem = (
                f"method must be discrete, since the file has a system that is sampled every {period:g} s"
            )
            raise ParameterError("method", problem)
        if abs(self.period - period) > 1e-9 * period:
            problem = f"file must have a system that is sampled every {self.period:g} s, as the block is"
            raise ParameterError("file", f"{problem}, got {period:g} s")

    def computed(self, model: Model, exact: Model | None = None) -> Model:
        """Return a model as ``method`` says, ``exact`` for `MATCHED`; zeros as long as the period is unknown.

        ParameterError if the method has no solution, or does not suit ``prewarp``.
        """
        if self.prewarp and self.method != TUSTIN:
            raise ParameterError("prewarp", "prewarp must be 0 unless method is tustin")
        if self.prewarp * self.period >= np.pi:
            half = f"half the sample rate, {np.pi / self.period:.6g} rad/s"
            raise ParameterError("prewarp", f"prewarp must be below {half}, got {self.prewarp:.6g} rad/s")
        if self.method in (CONTINUOUS, DISCRETE):
            return model
        if np.isnan(self.period):
            return Model(*(np.zeros_like(matrix) for matrix in model))
        if self.method == MATCHED and exact is not None:
            return exact
        return computed(self, model, self.prewarp)


def computed(block: Any, model: Model, prewarp: float = 0.0) -> Model:
    """Return a continuous model sampled by the method of a block; ParameterError if it has no solution."""
    try:
        with np.errstate(all="ignore"):
            return sampled(model, block.method, block.period, prewarp)
    except (np.linalg.LinAlgError, ValueError, OverflowError):
        problem = f"method must be another one than {METHODS[block.method]}, which has no solution here"
        raise ParameterError("method", problem) from None
