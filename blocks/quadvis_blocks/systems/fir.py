"""A digital filter without feedback."""

from __future__ import annotations

from typing import Any

import numpy as np

from quadvis.block import Block, In, Out, Param, State


class Fir(Block):
    """A digital filter of finite impulse response, for a scalar, or for each element of an array.

    ``y[k] = gain (c[0] u[k] + c[1] u[k-1] + ...)``. The inputs before the start are ``initial_input``.

    Source: A. V. Oppenheim, R. W. Schafer, Discrete-Time Signal Processing, section 6.5.
    """

    coefficients = Param(type="float64[n]", tune=True, doc="c: of the present input, of the one before ...")
    gain = Param(1.0, unit="b/a", tune=True, doc="a factor, which brings the unit of the output")
    initial_input = Param(0.0, type="float64[*?]", unit="a", doc="the input before the start")
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="b", doc="the output, in the unit of the input times that of ``gain``")
    past = State("float64[n,*]", doc="the last inputs, in a ring")
    place = State("int64", doc="where the next one goes")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        smooth:
          block: systems.fir
          rate: fast
          with: {coefficients: [0.1, 0.2, 0.4, 0.2, 0.1]}
          in: {u: wave.y}
    """

    def start(self) -> None:
        """Begin with the initial input."""
        for row in range(self.coefficients.size):
            self.past[row] = self.initial_input
        self.place = 0

    def output(self, u: Any) -> Any:
        """Return the weighted sum of the last inputs."""
        if isinstance(u, float):
            return self.gain * _sum(self, u, 0, 1)
        y = np.empty_like(u)
        for index in range(u.size):
            y.flat[index] = self.gain * _sum(self, u.flat[index], index, u.size)
        return y

    def update(self, u: Any) -> None:
        """Keep the input in the place of the oldest."""
        self.past[self.place] = u
        self.place = (self.place + 1) % self.coefficients.size


def _sum(block: Any, u: float, index: int, count: int) -> float:
    total = block.coefficients[0] * u
    row = block.place
    for number in range(1, block.coefficients.size):
        row = row - 1 if row > 0 else block.coefficients.size - 1
        total += block.coefficients[number] * block.past.flat[row * count + index]
    return float(total)
