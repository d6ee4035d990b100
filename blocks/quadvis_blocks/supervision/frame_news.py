"""The frames that are news, and the instants at which they were taken."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._digest import NOTHING, digest
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep
from quadvis_blocks.supervision._vision import FROZEN, trouble_of

RECENT = 32  # remembered frames: a camera that repeats a cycle of up to so many old frames brings no news
STALE = 0  # of the choices of repeats


class FrameNews(Block):
    """The stamp of the newest frame that is news, in run time; it does not change while no frame is news.

    A frame is news if its stamp is news (later than all before, not ahead of the time, finite), and if its
    measurement is not equal, to the last bit, to the measurement of one of the last 32 different frames. A
    camera has noise. So a picture or a measurement that repeats means that the camera froze, or that it
    repeats a cycle of old pictures, whatever stamps and numbers these have. Measurements without noise may
    repeat because nothing moves: for them set ``repeats`` to ``news``, or leave ``value`` out. A restarted
    clock counts again after ``restart``, with its stamps shifted into run time.

    Put this block where frames come in, and pass ``instant`` to all blocks that take a stamp. Then these
    blocks agree on which frames count.

    Reasons: 0 none, 4 frozen, 5 a stamp ahead of the time, back or NaN, 6 a restarted clock.
    """

    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    repeats = Param(
        "stale",
        choices=("stale", "news"),
        doc="whether a measurement that repeats to the bit is news",
    )
    stamp = In(unit="s", doc="instant of the newest frame by the camera's clock; NaN before the first")
    value = In("float64[*]", unit="a", default=math.nan, doc="measurement in that frame, if it has noise")
    frozen = In("bool", default=False, doc="whether another block reports that the pictures repeat")
    instant = Out(unit="s", nan=True, doc="instant of the newest frame that was news; NaN before the first")
    fresh = Out("bool", doc="whether a frame is news at this tick")
    reason = Out("int64", doc="trouble with the newest frame: 0 none, 4 frozen, 5 its stamp, 6 its clock")
    taken = State(unit="s", init=math.nan)
    recent = State(f"int64[{RECENT}]", NOTHING)  # digests of measurements, the newest first
    cause = State("int64")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    seen = Work("int64")  # digest of the measurement of this tick
    known = Work("bool")  # whether that is one of the recent measurements
    cause_now = Work("int64")

    example = """
        now: {block: sources.clock, rate: slow}
        gap: {block: signal.outage, rate: slow, with: {during: [[0.3 s, 0.6 s]]}, in: {u: now.y}}
        news: {block: supervision.frame_news, rate: slow, in: {stamp: gap.y}}
    """

    def start(self) -> None:
        """Begin without a frame."""
        begin(self.stamps)

    def output(self, stamp: float, value: Any, frozen: bool, time: float) -> tuple[float, bool, int]:
        """Return the instant of the newest frame that was news, whether it came now, and the trouble."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        self.seen = digest(value) if self.verdict == NEWS and self.repeats == STALE else NOTHING
        self.known = frozen or _is_known(self.seen, self.recent)
        self.cause_now = FROZEN if self.known else trouble_of(self.verdict, self.cause)
        if self.known or self.verdict != NEWS or math.isnan(stamp):
            return self.taken, False, self.cause_now
        return self.moment, True, self.cause_now

    def update(self, stamp: float, time: float) -> None:
        """Keep a new frame."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        self.cause = self.cause_now
        if self.known:
            return
        if self.verdict == NEWS and not math.isnan(stamp):
            self.taken = self.moment
        if self.seen != NOTHING:
            self.recent[1:] = self.recent[:-1].copy()
            self.recent[0] = self.seen


def _is_known(seen: int, recent: Any) -> bool:
    """Return whether a measurement is one of the recent ones; a measurement without a number never is."""
    return bool(seen != NOTHING and (recent == seen).any())
