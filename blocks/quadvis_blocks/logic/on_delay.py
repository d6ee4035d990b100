"""A truth value that must last before it counts."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param, State, reached


class OnDelay(Block):
    """True while a truth value has been true for some time without a break; false at once when it is false.

    What is true at the start counts from the start.
    """

    delay = Param(1.0, unit="s", min=0.0, tune=True, shown=True, doc="how long it must be true")
    u = In("bool", doc="the truth value")
    y = Out("bool", doc="whether it has lasted")
    since = State(unit="s", doc="the instant from which on it is true")
    before = State("bool", doc="the truth value at the tick before")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: wave.y, b: 0 m}}
        lasts: {block: logic.on_delay, rate: fast, with: {delay: 100 ms}, in: {u: high.y}}
    """

    def output(self, u: bool, time: float) -> bool:
        """Return whether it has lasted."""
        since = self.since if self.before else time
        return bool(u and reached(time - since, self.delay))

    def update(self, u: bool, time: float) -> None:
        """Keep the instant at which it became true."""
        if not self.before:
            self.since = time
        self.before = u
