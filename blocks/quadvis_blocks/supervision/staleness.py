"""The age of the last news of a signal."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work, passed
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep


class Staleness(Block):
    """The time since a signal last brought news, and whether that time is too long.

    News is a stamp later than all before, a sequence number that differs from the last, or a value with an
    element that differs from the last. Connect the inputs that the signal has. Inputs that are not connected,
    NaN, and stamps ahead of the time bring no news. The age counts from the stamp of the news; without a
    stamp it counts from the tick at which the news came. Before the first news it counts from the start.
    """

    max_age = Param(
        0.1,
        unit="s",
        min=0.0,
        tune=True,
        doc="greatest age (inclusive) that is not stale; 0.1 s suits an IMU",
    )
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    stamp = In(unit="s", default=math.nan, doc="instant of the measurement")
    sequence = In("int64", default=0, doc="number of the measurement")
    value = In("float64[*]", unit="a", default=0.0, doc="the measurement, if it has noise and never repeats")
    age = Out(unit="s", doc="time since the last news")
    stale = Out("bool", doc="whether the age is more than ``max_age``")
    news = State(unit="s")
    last_sequence = State("int64")
    last_value = State("float64[*]")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    newest = Work(unit="s")  # when the last news came

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        gap: {block: signal.outage, rate: fast, with: {during: [[0.2 s, 0.9 s]]}, in: {u: wave.y}}
        stale: {block: supervision.staleness, rate: fast, in: {value: gap.y}}
    """

    def start(self) -> None:
        """Begin without news."""
        begin(self.stamps)

    def output(self, stamp: float, sequence: int, value: Any, time: float) -> tuple[float, bool]:
        """Return the age, and whether it is too great."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        if self.verdict == NEWS and not math.isnan(stamp):
            self.newest = self.moment
        elif sequence != self.last_sequence or _differs(value, self.last_value):
            self.newest = time
        else:
            self.newest = self.news
        age = time - self.newest
        return max(0.0, age), passed(age, self.max_age)

    def update(self, stamp: float, sequence: int, value: Any, time: float) -> None:
        """Keep stamp, sequence number and value."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        self.news = self.newest
        self.last_sequence = sequence
        self.last_value = value


def _differs(value: Any, last: Any) -> bool:
    """Return whether an element is a number that differs from its last value."""
    if isinstance(value, float):
        return value == value and value != last
    for place in range(value.size):
        element = value.flat[place]
        if element == element and element != last.flat[place]:
            return True
    return False
