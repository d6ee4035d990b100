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
    corner = Param(type="float64[k]", unit="Hz", above=0.0, doc="the corner, or both of a band, rising")
    band = Param("low", choices=BANDS, doc="what passes: below the corner, above it, the band, or all else")
    method = Param("digital", choices=("digital", "continuous"), doc="how it is computed")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        smooth: {block: systems.butterworth, rate: fast, with: {order: 4, corner: [5 Hz]}, in: {u: wave.y}}
    """

    @classmethod
    def ports(cls, order: int, band: int, method: int) -> dict[str, Any]:
        """Return states for the order."""
        poles = order if band in (LOW, HIGH) else 2 * order
        return lti(poles, method == CONTINUOUS, direct=method == DIGITAL or band not in (LOW, BAND))

    def check(self) -> None:
        """Refuse corners of another number, that do not rise, or at half the sample rate."""
        wanted = 1 if self.band in (LOW, HIGH) else 2
        if len(self.corner) != wanted or np.any(np.diff(self.corner) <= 0.0):
            words = "one frequency" if wanted == 1 else "two frequencies that rise"
            raise ParameterError("corner", f"corner must be {words} for band {BANDS[self.band]}")
        if self.method == DIGITAL and self.corner[-1] * self.period >= 0.5:
            half = 0.5 / self.period
            problem = f"corner must be below half the sample rate, {half:g} Hz, got {self.corner[-1]:g} Hz"
            raise ParameterError("corner", problem)
        corners = 2.0 * np.pi * np.asarray(self.corner)
        with np.errstate(all="ignore"):
            if self.method == CONTINUOUS:
                model = of_roots(*analog(self.order, self.band, corners))
            else:
                period = self.period if self.period == self.period else 0.1 / self.corner[-1]
                model = of_roots(*digital(self.order, self.band, corners, period))
        self.take(model, discrete=self.method == DIGITAL)
