"""Amplitudes and phases of a signal at some frequencies."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, ParameterError, State

NONE, HANN = range(2)


class Spectrum(Block):
    """Amplitude and phase of a signal at some frequencies, over windows of ``samples`` samples.

    A window follows the other; the outputs are those of the last one that is whole, 0 before the first. Of
    ``u = a cos(2 pi f t + phase)`` they are a and phase, if the window holds whole periods, with t = 0 at the
    first sample of the window: ``a = 2/n |sum(w u exp(-2 pi i f t))|``, without the 2 at 0 and at half the
    sample rate. ``window: hann`` weighs by ``w = 1 - cos(2 pi k / n)``, so that frequencies far away matter
    less. For the whole spectrum list the multiples of the sample rate over n.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, sections 8.5 and 10.1.
    """

    frequencies = Param(type="float64[k]", unit="Hz", min=0.0, doc="where the spectrum is computed")
    samples = Param(100, type="int64", min=1, max=10_000_000, shown=True, doc="length of a window, n")
    window = Param("none", choices=("none", "hann"), doc="how the samples of a window are weighed")
    u = In(unit="a", doc="the signal")
    amplitude = Out("float64[k]", unit="a", doc="amplitude at each frequency")
    phase = Out("float64[k]", unit="rad", doc="phase of the cosine at each frequency, -pi to pi")
    place = State("int64", doc="number of the sample in its window")
    real = State("float64[k]", doc="sums of this window")
    imaginary = State("float64[k]", doc="sums of this window")
    whole_real = State("float64[k]", doc="sums of the last whole window")
    whole_imaginary = State("float64[k]", doc="sums of the last whole window")

    symbol = "spectrum"
    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 0.2 Hz}}
        lines:
          block: systems.spectrum
          rate: fast
          with: {frequencies: [0 Hz, 0.2 Hz, 0.4 Hz], samples: 50}
          in: {u: wave.y}
    """

    def check(self) -> None:
        """Refuse frequencies beyond half the sample rate."""
        most = float(np.max(self.frequencies, initial=0.0))
        if not math.isfinite(most) or most * self.period > 0.5 * (1.0 + 1e-9):
            words = (
                f"at most half the sample rate, {0.5 / self.period:g} Hz" if math.isfinite(most) else "finite"
            )
            raise ParameterError("frequencies", f"frequencies must be {words}, got {most:g} Hz")

    def output(self) -> Any:
        """Return amplitudes and phases of the last whole window."""
        amplitude, phase = np.empty_like(self.real), np.empty_like(self.real)
        for number in range(amplitude.size):
            real, imaginary = self.whole_real[number], self.whole_imaginary[number]
            turns = self.frequencies[number] * self.period
            scale = 1.0 if turns == 0.0 or abs(turns - 0.5) < 1e-9 else 2.0
            amplitude[number] = scale * math.sqrt(real * real + imaginary * imaginary) / self.samples
            phase[number] = math.atan2(imaginary, real)
        return amplitude, phase

    def update(self, u: float) -> None:
        """Add the sample; at the end of a window keep its sums."""
        weight = 1.0
        if self.window == HANN:
            weight -= math.cos(2.0 * math.pi * self.place / self.samples)
        for number in range(self.real.size):
            turns = self.frequencies[number] * self.period * self.place
            angle = 2.0 * math.pi * (turns - math.floor(turns))
            self.real[number] += weight * u * math.cos(angle)
            self.imaginary[number] -= weight * u * math.sin(angle)
        self.place += 1
        if self.place == self.samples:
            self.whole_real[:] = self.real
            self.whole_imaginary[:] = self.imaginary
            self.real[:] = 0.0
            self.imaginary[:] = 0.0
            self.place = 0
