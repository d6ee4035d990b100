"""Rate of change by backward difference."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work, all_finite, copied, passed, zeros_like
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep


class Derivative(Block):
    """Rate of change of a sampled signal by backward difference: ``rate = (u_t - u_{t-T}) / T``.

    T is the true time between the two samples, from their stamps; without stamps T is the time between
    ticks. A sample is skipped if its stamp is no news (repeated, back, ahead of the time, NaN), if ``valid``
    is false or if its value has NaN. A skipped sample leaves the rate as it was, so the block may run faster
    than the camera. The rate is 0 and ``ok`` is false before the second sample, and again after a gap. A gap
    is a time longer than ``gap_reset`` between two stamps or between the arrivals of two samples. Successive
    ticks are never a gap.

    Source: section 6.2. Error: at most ``M T / 2`` for a signal with ``|u''| <= M``; noise of standard
    deviation s in the signal becomes ``s sqrt(2) / T`` in the rate.
    """

    gap_reset = Param(
        0.4, unit="s", above=0.0, tune=True, doc="longest gap (inclusive) that a difference may span"
    )
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    u = In("float64[*]", unit="a", doc="the signal; NaN where it is missing")
    stamp = In(unit="s", default=math.nan, doc="instant at which u was measured; NaN means now")
    valid = In("bool", default=True, doc="whether u is good")
    rate = Out("float64[*]", unit="a/s", doc="rate of change")
    ok = Out("bool", doc="whether the rate comes from two samples without a gap")
    last = State("float64[*]")
    last_rate = State("float64[*]")
    last_ok = State("bool")
    measured = State(unit="s")
    arrived = State(unit="s")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    good = Work("bool")  # whether this sample counts
    rate_now = Work("float64[*]")
    ok_now = Work("bool")

    example = """
        wave: {block: sources.sine, rate: fast, with: {amplitude: 2 m, frequency: 1 Hz}}
        speed: {block: signal.derivative, rate: fast, in: {u: wave.y}}
    """

    def picture_formula(self) -> tuple[str, ...]:
        """Return the derivative."""
        return ("du / dt",)

    def start(self) -> None:
        """Forget all samples."""
        begin(self.stamps)
        self.measured = -math.inf
        self.arrived = -math.inf

    def output(self, u: Any, stamp: float, valid: bool, time: float) -> tuple[Any, bool]:
        """Return the rate, and whether it comes from two samples without a gap."""
        longest = max(self.gap_reset, 1.5 * self.period)
        in_time = not passed(time - self.arrived, longest)
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        elapsed = self.moment - self.measured
        self.good = valid and self.verdict == NEWS and elapsed > 0.0 and all_finite(u)
        if self.good:
            self.ok_now = in_time and not passed(elapsed, longest)
            self.rate_now = (u - self.last) / elapsed if self.ok_now else zeros_like(u)
            return copied(self.rate_now), self.ok_now
        if in_time:
            return copied(self.last_rate), self.last_ok
        return zeros_like(self.last_rate), False

    def update(self, u: Any, stamp: float, time: float) -> None:
        """Keep this sample if it is new and good."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        if self.good:
            self.last_ok = self.ok_now
            self.last_rate = self.rate_now
            self.last = u
            self.measured = self.moment
            self.arrived = time
