"""A Butterworth filter."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, Param, ParameterError
from quadvis_blocks.systems._butterworth import BAND, BANDS, HIGH, LOW, analog, digital
from quadvis_blocks.systems._lti import Lti, lti
from quadvis_blocks.systems._models import of_roots

DIGITAL, CONTINUOUS = range(2)


class Butterworth(Lti, Block):
    """A Butterworth filter: flat in its band, and 1/sqrt(2) at its corners; for a scalar, or each element.

    At a rate it is scipy's ``butter``: the bilinear transform, with the corners at their place. It runs as a
    chain of sections of order 2, so high orders and low corners stay accurate. A filter of a band has twice
    the order. With ``method: continuous`` the solver computes it, without a ``rate``. It begins at rest, or
    in the steady state of ``initial_input``.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, chapter 7.
    """

    order = Param(2, type="int64", min=1, max=20, doc="order of the low-pass filter behind it")
    corner = Param(unit="Hz", above=0.0, shown=True, doc="the corner; of a band the lower one")
    upper_corner = Param(0.0, unit="Hz", min=0.0, shown=True, doc="the upper corner of a band; 0 is none")
    band = Param(
        "low", choices=BANDS, shown=True, doc="what passes: below the corner, above it, the band, or all else"
    )
    method = Param("digital", choices=("digital", "continuous"), doc="how it is computed")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 0.1 Hz}}
        smooth: {block: systems.butterworth, rate: fast, with: {order: 4, corner: 0.3 Hz}, in: {u: wave.y}}
    """

    @classmethod
    def ports(cls, order: int, band: int, method: int) -> dict[str, Any]:
        """Return states for the order."""
        poles = order if band in (LOW, HIGH) else 2 * order
        return lti(poles, method == CONTINUOUS, direct=method == DIGITAL or band not in (LOW, BAND))

    def check(self) -> None:
        """Refuse corners that are too many or too few, or at half the sample rate."""
        two = self.band not in (LOW, HIGH)
        if two and self.upper_corner <= self.corner:
            problem = f"upper_corner must be above corner, {self.corner:g} Hz, got {self.upper_corner:g} Hz"
            raise ParameterError("upper_corner", problem)
        if not two and self.upper_corner:
            raise ParameterError("upper_corner", f"upper_corner must be 0 for band {BANDS[self.band]}")
        name = "upper_corner" if two else "corner"
        most = getattr(self, name)
        if self.method == DIGITAL and most * self.period >= 0.5:
            half = 0.5 / self.period
            problem = f"{name} must be below half the sample rate, {half:g} Hz, got {most:g} Hz"
            raise ParameterError(name, problem)
        corners = 2.0 * np.pi * np.array([self.corner, self.upper_corner][: 1 + two])
        with np.errstate(all="ignore"):
            if self.method == CONTINUOUS:
                model = of_roots(*analog(self.order, self.band, corners))
            else:
                period = self.period if self.period == self.period else 0.1 / most
                model = of_roots(*digital(self.order, self.band, corners, period))
        self.take(model, discrete=self.method == DIGITAL)
