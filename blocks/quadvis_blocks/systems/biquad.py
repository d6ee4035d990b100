"""Digital sections of second order."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Param, ParameterError
from quadvis_blocks.systems._lti import Lti, lti
from quadvis_blocks.systems._models import of_sections


class Biquad(Lti, Block):
    """A digital filter of sections of second order, for a scalar, or for each element of an array.

    Each section is ``(b0 + b1 z^-1 + b2 z^-2) / (a0 + a1 z^-1 + a2 z^-2)``, a row
    ``[b0, b1, b2, a0, a1, a2]`` as of scipy's ``sos``. It has direct feedthrough and begins at
    rest, or in the steady state of ``initial_input``.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, section 6.3.
    """

    sections = Param(type="float64[s,6]", doc="the coefficients, a row for each section")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        notch:
          block: systems.biquad
          rate: fast
          with: {sections: [[0.9, -1.2, 0.9, 1, -1.2, 0.8]]}
          in: {u: wave.y}
    """

    @classmethod
    def ports(cls, sections: Any) -> dict[str, Any]:
        """Return states for the sections."""
        return lti(max(2 * len(sections), 1), False, direct=True)

    def check(self) -> None:
        """Refuse sections that have no first coefficient."""
        rows = np.asarray(self.sections)
        if not len(rows) or not np.isfinite(rows).all() or not rows[:, 3].all():
            raise ParameterError("sections", "sections must be finite, with an a0 that is not 0")
        with np.errstate(all="ignore"):
            model = of_sections([(row[:3], row[3:]) for row in rows])
        self.take(model, discrete=True)
