"""One of two signals, by a truth value."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, copied


class Switch(Block):
    """One of two signals: ``then`` while the condition is true, ``otherwise`` while it is false."""

    condition = In("bool", doc="which of them")
    then = In("float64[*]", unit="a", doc="the output while the condition is true")
    otherwise = In("float64[*]", unit="a", doc="the output while it is false")
    y = Out("float64[*]", unit="a", doc="the chosen signal")

    symbol = "switch"
    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: wave.y, b: 0 m}}
        half: {block: logic.switch, rate: fast, in: {condition: high.y, then: wave.y, otherwise: 0 m}}
    """

    def output(self, condition: bool, then: Any, otherwise: Any) -> Any:
        """Return the chosen signal."""
        return copied(then) if condition else copied(otherwise)
