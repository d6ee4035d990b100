"""A counter of edges."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, State
from quadvis_blocks._edges import NAMES, fires
from quadvis_blocks._limits import refuse_reversed

HOLD, WRAP = range(2)
MOST = 2**31 - 1


class Counter(Block):
    """How often a truth value has risen, between limits; with ``down`` true it counts back.

    It counts at the tick of the edge. What is true at the start is no edge. With ``count_on: level`` every
    tick counts at which the truth value is true. While ``reset`` is true the count is ``initial``. Beyond a
    limit the count stays there, or goes on from the other one.
    """

    count_on = Param("rising", choices=NAMES, shown=True, doc="what counts")
    initial = Param(0, type="int64", doc="the count at the start and at a reset")
    lower = Param(0, type="int64", min=-MOST, max=MOST, tune=True, doc="smallest count")
    upper = Param(MOST, type="int64", min=-MOST, max=MOST, tune=True, doc="largest count")
    at_limit = Param(
        "hold", choices=("hold", "wrap"), doc="beyond a limit: stay, or go on from the other one"
    )
    u = In("bool", doc="the truth value")
    down = In("bool", default=False, doc="true to count back")
    reset = In("bool", default=False, doc="true to begin again")
    y = Out("int64", doc="the count")
    count = State("int64")
    before = State("bool", doc="the truth value at the tick before")
    seen = State("bool", doc="whether there was one")

    example = """
        pulses: {block: sources.pulse, rate: fast, with: {interval: 0.2 s, width: 0.1 s, begin: 0.1 s}}
        high: {block: logic.compare, rate: fast, with: {operator: ">"}, in: {a: pulses.y, b: 0.5}}
        digit: {block: logic.counter, rate: fast, with: {upper: 9, at_limit: wrap}, in: {u: high.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return that it counts."""
        return ("1 2 3",)

    def check(self) -> None:
        """Refuse limits that exclude each other or the initial count."""
        refuse_reversed(("lower", self.lower), ("upper", self.upper))
        refuse_reversed(("lower", self.lower), ("initial", self.initial))
        refuse_reversed(("initial", self.initial), ("upper", self.upper))

    def start(self) -> None:
        """Begin with the initial count."""
        self.count = self.initial
        self.seen = False

    def output(self, u: bool, down: bool, reset: bool) -> Any:
        """Return the count."""
        if reset:
            return self.initial
        if not fires(self.count_on, u, self.before, self.seen):
            return self.count
        return _next(self.count, down, self.lower, self.upper, self.at_limit)

    def update(self, u: bool, down: bool, reset: bool) -> None:
        """Keep the count."""
        if reset:
            self.count = self.initial
        elif fires(self.count_on, u, self.before, self.seen):
            self.count = _next(self.count, down, self.lower, self.upper, self.at_limit)
        self.before = u
        self.seen = True


def _next(count: int, down: bool, lower: int, upper: int, at_limit: int) -> int:
    """Return the count that follows."""
    if down:
        return count - 1 if count > lower else lower if at_limit == HOLD else upper
    return count + 1 if count < upper else upper if at_limit == HOLD else lower
