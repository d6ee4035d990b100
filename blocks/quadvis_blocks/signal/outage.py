"""A signal that fails for a while, on purpose."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, ParameterError, State, Work, copied, reached


class Outage(Block):
    """A signal that stands still, and is marked as not good, during outages.

    Outages imitate a camera that goes blind, an IMU that hangs or a lost link of the pilot. During an outage
    ``y`` keeps the last value from before the outage, and ``ok`` is false. At all other times ``y`` is the
    signal, and ``ok`` is ``valid``. A stamp that passes through this block stands still too.
    """

    during = Param(type="float64[k,2]", unit="s", doc="beginning (inclusive) and end of each outage")
    u = In("float64[*]", unit="a", doc="any signal")
    valid = In("bool", default=True, doc="whether the signal is good")
    y = Out("float64[*]", unit="a", nan=True, doc="the signal, or its last value from before the outage")
    ok = Out("bool", doc="whether the signal is good and there is no outage")
    last = State("float64[*]")
    out = Work("bool")  # whether there is an outage now

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        gap: {block: signal.outage, rate: fast, with: {during: [[0.2 s, 0.6 s]]}, in: {u: wave.y}}
    """

    def check(self) -> None:
        """Refuse outages that end before they begin."""
        for begin, end in self.during:
            if begin >= end:
                problem = f"during must be rows of a begin and a later end, got {begin:g} s and {end:g} s"
                raise ParameterError("during", problem)

    def output(self, u: Any, valid: bool, time: float) -> tuple[Any, bool]:
        """Return the signal, or its last value from before the outage; and whether it is good."""
        self.out = _inside(self.during, time)
        if self.out:
            return copied(self.last), False
        return copied(u), valid

    def update(self, u: Any) -> None:
        """Keep the last value."""
        if not self.out:
            self.last = u


def _inside(during: Any, time: float) -> bool:
    """Return whether a time lies in one of the outages."""
    return bool((reached(time, during[:, 0]) & ~reached(time, during[:, 1])).any())
