"""Which frames are news, and when they were taken."""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work
from quadvis_blocks._digest import NOTHING, digest
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep
from quadvis_blocks.supervision._vision import FROZEN, trouble_of

RECENT = 32  # frames that are remembered: a camera that goes round in up to so many old ones has no news
STALE = 0  # of the choices of repeats


class FrameNews(Block):
    """The stamp of the newest frame that is news, in the time of the run; it stands still while none is.

    A frame is news if its stamp is (later than all before, not ahead of the time, finite) and if what was
    measured in it is not the same to the last bit as in one of the last 32 different frames: a camera has
    noise, so a picture or a measurement that repeats is a camera that froze, or that goes round in old ones,
    whatever stamps and numbers it gives. Measurements without noise may repeat because nothing moves: for
    them set ``repeats`` to ``news``, or leave ``value`` out. A clock that started again counts again after
    ``restart``, with its stamps shifted into the time of the run.

    Put it where frames come in, and hand its stamp to all that ask for one: they agree then on which frames
    count.

    Reasons: 0 none, 4 frozen, 5 a stamp ahead of the time, from before or NaN, 6 a clock that started again.
    """

    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a clock that started again runs until it counts",
    )
    repeats = Param(
        "stale", choices=("stale", "news"), doc="a measurement that repeats to the bit: no news, or news"
    )
    stamp = In(unit="s", doc="instant of the newest frame as the camera says; NaN for none yet")
    value = In("float64[*]", unit="a", default=math.nan, doc="what was measured in it, if it has noise")
    frozen = In("bool", default=False, doc="whether whoever looks at the pictures says that they repeat")
    instant = Out(unit="s", nan=True, doc="instant of the newest frame that was news; NaN before the first")
    fresh = Out("bool", doc="whether there is one at this tick")
    reason = Out("int64", doc="what was wrong with the newest: 0 nothing, 4 frozen, 5 its stamp, 6 its clock")
    taken = State(unit="s", init=math.nan)
    recent = State(f"int64[{RECENT}]", NOTHING)  # digests of measurements, the newest first
    cause = State("int64")
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of now
    moment = Work(unit="s")  # the instant that it stands for
    seen = Work("int64")  # digest of the measurement of now
    known = Work("bool")  # whether it is a recent one
    cause_now = Work("int64")

    def start(self) -> None:
        """Know no frame yet."""
        begin(self.stamps)

    def output(self, stamp: float, value: Any, frozen: bool, time: float) -> tuple[float, bool, int]:
        """Return the instant of the newest frame that was news, whether it is new, and what is wrong."""
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
    """Return whether a measurement is one of the recent ones; one without a number never is."""
    return bool(seen != NOTHING and (recent == seen).any())
