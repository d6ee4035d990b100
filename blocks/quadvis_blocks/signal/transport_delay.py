"""A pure delay of a held signal, such as a radio link."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work, reached
from quadvis_blocks._craft import RADIO_DELAY
from quadvis_blocks._delay import check_delay

CAPACITY = 512


class TransportDelay(Block):
    """A held signal, ``delay`` seconds later: ``y(t) = u(t - delay)``.

    The output is ``initial`` until the first input arrives. The input may change only at the block's ticks,
    as the output of a slower task does. In the continuous task the output may change inside a solver step;
    this gives the solver an error of up to half a step times the change. At a discrete rate the output
    changes at ticks: with the block at the solver's rate and a delay of a whole number of steps, there is no
    such error.

    Error: ParameterError if the delay is longer than 511 ticks of the block.
    """

    delay = Param(
        RADIO_DELAY,
        unit="s",
        above=0.0,
        shown=True,
        doc="time until a change arrives; default: the 22 ms of a radio frame",
    )
    initial = Param(0.0, type="float64[*?]", unit="a", doc="the output until the first input arrives")
    u = In("float64[*]", unit="a", doc="a held signal")
    y = Out("float64[*]", unit="a", doc="the signal of ``delay`` seconds ago")
    since = State(f"float64[{CAPACITY}]", unit="s")
    values = State(f"float64[{CAPACITY},*]")  # the value that arrived last, then the values on their way
    waiting = State("int64")
    arrived = Work("int64")  # index of the value that is the output now

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        radio: {block: signal.transport_delay, rate: fast, with: {delay: 50 ms}, in: {u: wave.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the transfer function."""
        return ("e⁻ˢᵀ",)

    def check(self) -> None:
        """Refuse a delay that holds more values than there is room for."""
        check_delay(self.delay, CAPACITY - 1, self.period)

    def start(self) -> None:
        """Begin with no value on its way."""
        self.since[0] = -math.inf
        self.values[0] = self.initial
        self.waiting = 0

    def output(self, time: float) -> Any:
        """Return the newest value that has had time to arrive."""
        self.arrived = _arrived(self.since, self.waiting, time - self.delay)
        return self.values[self.arrived]

    def update(self, u: Any, time: float) -> None:
        """Send the input on its way, even if it has not changed: the queue must not depend on the values."""
        first = self.arrived
        if first > 0:
            kept = self.waiting + 1 - first
            self.since[:kept] = self.since[first : first + kept].copy()
            self.values[:kept] = self.values[first : first + kept].copy()
            self.waiting -= first
        self.waiting += 1
        self.since[self.waiting] = time
        self.values[self.waiting] = u


def _arrived(since: Any, waiting: int, instant: float) -> int:
    """Return the index of the last value sent by ``instant``; 0 if all waiting values were sent later."""
    place = 0
    while place < waiting and reached(instant, since[place + 1]):
        place += 1
    return place
