"""The instants at which a truth value changes."""

from __future__ import annotations

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._edges import NAMES, fires


class Edge(Block):
    """True for one tick when a truth value changes. What is true at the start is no edge."""

    direction = Param("rising", choices=NAMES[:3], doc="which changes count")
    u = In("bool", doc="the truth value")
    y = Out("bool", doc="whether it has changed since the tick before")
    before = State("bool", doc="the truth value at the tick before")
    seen = State("bool", doc="whether there was one")

    example = """
        pulses: {block: sources.pulse, rate: fast, with: {interval: 0.2 s, width: 0.1 s}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: pulses.y, b: 0.5}}
        begun: {block: logic.edge, rate: fast, in: {u: high.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the edge."""
        return (("↑", "↓", "↕")[self.direction],)

    def output(self, u: bool) -> bool:
        """Return whether there is an edge."""
        return fires(self.direction, u, self.before, self.seen)

    def update(self, u: bool) -> None:
        """Keep the truth value."""
        self.before = u
        self.seen = True
