"""The last valid value of a measurement."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work, all_finite, copied, passed
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep


class HoldValid(Block):
    """The last valid value of a measurement, its age, and whether it is young enough.

    A value is valid if ``valid`` is true, if all its elements are finite (NaN never passes), and if its
    ``stamp`` is news: newer than the stamp of the held value and not ahead of the time. So a frame that was
    overtaken on its way does not count, and a repeated frame does not count. The age counts from the stamp;
    if no stamp is connected, it counts from the tick at which the value came. Before the first valid value
    the output is ``initial``, the age counts from the start, and ``ok`` is false.
    """

    max_age = Param(0.25, unit="s", min=0.0, tune=True, shown=True, doc="greatest age (inclusive) that is ok")
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    value = In("float64[*]", unit="a", doc="the measurement; NaN where it is missing")
    valid = In("bool", default=True, doc="whether the measurement is good")
    stamp = In(unit="s", default=math.nan, doc="instant of the measurement; NaN means now")
    initial = In("float64[*]", unit="a", default=0.0, doc="the output before the first valid value")
    held = Out("float64[*]", unit="a", doc="the last valid value")
    age = Out(unit="s", doc="time since the held value was measured")
    ok = Out("bool", doc="whether a value is held whose age is at most ``max_age``")
    last = State("float64[*]")
    measured = State(unit="s")
    seen = State("bool")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    good = Work("bool")  # whether the value of this tick counts

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        gap: {block: signal.outage, rate: fast, with: {during: [[0.2 s, 0.6 s]]}, in: {u: wave.y}}
        held: {block: signal.hold_valid, rate: fast, in: {value: gap.y, valid: gap.ok}}
    """

    def start(self) -> None:
        """Begin without a value."""
        begin(self.stamps)

    def output(
        self, value: Any, valid: bool, stamp: float, initial: Any, time: float
    ) -> tuple[Any, float, bool]:
        """Return the value if it is valid, else the last valid value; and its age, and whether that is ok."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        self.good = self.verdict == NEWS and _is_good(value, valid, self.moment, self.seen, self.measured)
        if self.good:
            held, measured, seen = copied(value), self.moment, True
        elif self.seen:
            held, measured, seen = copied(self.last), self.measured, True
        else:
            held, measured, seen = copied(initial), 0.0, False
        age = time - measured
        return held, age, seen and not passed(age, self.max_age)

    def update(self, value: Any, stamp: float, time: float) -> None:
        """Keep the value if it is valid."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        if self.good:
            self.last = value
            self.measured = self.moment
            self.seen = True


def _is_good(value: Any, valid: bool, made: float, seen: bool, measured: float) -> bool:
    """Return whether a value is good, and was measured after the held value."""
    return bool(valid and all_finite(value) and not (seen and made <= measured))
