"""A delay of one sample."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, State


class UnitDelay(Block):
    """The signal of one sample ago: ``y[k] = u[k-1]``, ``y[0] = initial``. It breaks algebraic loops."""

    initial = Param(0.0, type="float64[*?]", unit="a", doc="the output at the first sample")
    u = In("float64[*]", unit="a", doc="any signal")
    y = Out("float64[*]", unit="a", doc="the signal of one sample ago")
    last = State("float64[*]")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        before: {block: signal.unit_delay, rate: fast, in: {u: wave.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the shift by a sample."""
        return ("z⁻¹",)

    def start(self) -> None:
        """Begin with the initial value."""
        self.last = self.initial

    def output(self) -> Any:
        """Return the last sample."""
        return self.last

    def update(self, u: Any) -> None:
        """Keep this sample."""
        self.last = u
