"""A pure delay of a held signal, such as a radio link."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State

CAPACITY = 512
INSTANT = 1e-9  # s; an edge that is due at a tick must not wait for the next one because of rounding


class TransportDelay(Block):
    """A held signal, ``delay`` seconds later: ``y(t) = u(t - delay)``.

    Before anything came through the output is ``initial``. The input may change at the block's ticks only, as
    the output of a slower task does. In the continuous task the output may change inside a solver step, which
    costs the solver an error of up to half that step times the change. At a discrete rate it changes at
    ticks: with the block at the solver's rate and a delay of a whole number of steps, nothing is lost.

    Error: OverflowError if more than 511 changes of the input are on their way at once.
    """

    delay = Param(
        0.022, unit="s", above=0.0, doc="time that a change takes; default the 22 ms of a radio frame"
    )
    initial = Param(0.0, unit="a", doc="every element of the output until the first input arrives")
    u = In("float64[n]", unit="a", doc="a held signal")
    y = Out("float64[n]", unit="a", doc="the signal of ``delay`` seconds ago")
    since = State(f"float64[{CAPACITY}]", unit="s")
    values = State(f"float64[{CAPACITY},n]")
    oldest = State("int64", 0)
    newest = State("int64", 0)

    def start(self) -> None:
        """Forget everything on its way."""
        self.since[0] = -math.inf
        self.values[0, :] = self.initial
        self.oldest = 0
        self.newest = 0

    def output(self, time: float) -> Any:
        """Return the newest value that has had time to arrive."""
        return self.values[_arrived(self.since, self.oldest, self.newest, time - self.delay)]

    def update(self, u: Any, time: float) -> None:
        """Send a change on its way."""
        self.oldest = _arrived(self.since, self.oldest, self.newest, time - self.delay)
        if (u == self.values[self.newest]).all():
            return
        following = (self.newest + 1) % CAPACITY
        if following == self.oldest:
            raise OverflowError(
                "more than 511 changes are on their way; give the block a slower rate or a shorter delay"
            )
        self.since[following] = time
        self.values[following, :] = u
        self.newest = following


def _arrived(since: Any, oldest: int, newest: int, instant: float) -> int:
    """Return the place of the last value sent by ``instant``; ``oldest`` was there already."""
    place = oldest
    while place != newest and since[(place + 1) % CAPACITY] <= instant + INSTANT:
        place = (place + 1) % CAPACITY
    return place
