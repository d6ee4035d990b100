"""The state of vision, judged by the stamps of its frames."""

from __future__ import annotations

import math

from quadvis.block import Block, In, Out, Param, ParameterError, State, Work, passed, reached
from quadvis_blocks._stamps import NEWS, RESTART, SIZE, begin, judge, keep
from quadvis_blocks.supervision._vision import (
    COAST,
    CONTRADICTED,
    FRESH,
    LAND,
    LEVEL,
    NO_FRAMES,
    NONE,
    REARMING,
    TARGET_LOST,
    trouble_of,
)

OF_TRUST, OF_FRAME = range(2)


class VisionWatchdog(Block):
    """How far vision can be trusted, by the age of its last good frame.

    ===== ===== ========================================= ============================================
    state word  entered                                   meant for
    ===== ===== ========================================= ============================================
    0     FRESH see below                                 all of vision counts
    1     COAST a good frame is older than ``coast``      no velocity by differences; dead reckoning
    2     LEVEL and vision is gone for ``level``          no position errors: level, hold height
    3     LAND  and vision is gone for ``land``           descend, or hand over to the pilot
    ===== ===== ========================================= ============================================

    The age counts from the stamp of the frame, not from its arrival. Vision is gone since the last good frame
    of the FRESH state, or since the start. Single good frames after that do not stop this clock; they only
    delay the next state for as long as they are fresh. With ``clock: frame``, for an estimator that uses
    single frames well, vision is gone since the last good frame of any state.

    The state goes down at most one step per tick. It goes back to FRESH only after ``frames`` good frames in
    a row, never stale in between, over at least ``proof``. It starts at COAST: vision has to prove itself.

    ====== =================================================== =============================
    reason meaning                                             found from
    ====== =================================================== =============================
    0      none
    1      no new frames                                       the stamps
    2      frames come, but the target is not found            ``valid``
    3      too few good frames yet                             the stamps and ``valid``
    4      frames are frozen: the same frame again and again   ``trouble``
    5      stamps are ahead of the time, back or NaN           the stamps, or ``trouble``
    6      the camera's clock restarted                        the stamps, or ``trouble``
    7      frames contradict the inertial unit                 ``contradicted``, ``trouble``
    ====== =================================================== =============================

    With a camera of 10 frames/s and the control at 20 Hz, the default ``coast`` allows one lost frame, and
    the state changes at most 0.3 s after the last good frame was taken.
    """

    coast = Param(0.25, unit="s", above=0.0, tune=True, doc="greatest age (inclusive) of a FRESH frame")
    level = Param(2.0, unit="s", above=0.0, tune=True, doc="time without vision to LEVEL")
    land = Param(5.0, unit="s", above=0.0, tune=True, doc="time without vision to LAND")
    frames = Param(5, type="int64", min=1, tune=True, doc="good frames in a row to be FRESH again")
    proof = Param(0.5, unit="s", min=0.0, tune=True, doc="least time from the first of them to the last")
    clock = Param(
        "trust",
        choices=("trust", "frame"),
        doc="vision is gone since the last good frame in FRESH (trust), or in any state (frame)",
    )
    restart = Param(
        RESTART,
        unit="s",
        above=0.0,
        tune=True,
        doc="how long a restarted clock must run before its stamps count",
    )
    stamp = In(unit="s", doc="instant of the newest frame; NaN before the first")
    valid = In("bool", doc="whether the newest frame gave a pose")
    trouble = In(
        "int64", default=NONE, doc="why frames do not count, by `supervision.frame_news`; 0 if they do"
    )
    contradicted = In("bool", default=False, doc="whether the estimator refused the newest frame")
    state = Out("int64", doc="0 FRESH, 1 COAST, 2 LEVEL, 3 LAND")
    reason = Out("int64", doc="0 none, 1 no new frames, 2 target not found, 3 too few yet; 4 to 7 see above")
    age = Out(unit="s", doc="time since the last good frame was taken, or since the start")
    stale = Out("bool", doc="whether the age is more than ``coast``")
    rearmed = Out("bool", doc="true for the one tick at which the state becomes FRESH")
    now = State("int64", COAST)
    newest = State(unit="s")  # stamp of any frame
    good = State(unit="s")  # stamp of the last good frame
    since = State(unit="s")  # stamp of the last good frame of the FRESH state
    first = State(unit="s")  # stamp of the first good frame of the row
    row = State("int64")
    cause = State("int64")  # trouble with the stamp that was seen last
    stamps = State(f"float64[{SIZE}]")
    verdict = Work("int64")  # on the stamp of this tick
    moment = Work(unit="s")  # the instant of that stamp
    state_now = Work("int64")
    newest_now = Work(unit="s")
    good_now = Work(unit="s")
    first_now = Work(unit="s")
    row_now = Work("int64")
    cause_now = Work("int64")

    example = """
        now: {block: sources.clock, rate: fast}
        gap: {block: signal.outage, rate: fast, with: {during: [[0.2 s, 0.9 s]]}, in: {u: now.y}}
        watchdog: {block: supervision.vision_watchdog, rate: fast, in: {stamp: gap.y, valid: gap.ok}}
    """

    def check(self) -> None:
        """Refuse times that do not increase from state to state."""
        for name, after, limit in (("level", "coast", self.coast), ("land", "level", self.level)):
            if getattr(self, name) <= limit:
                found = f"{getattr(self, name):g} s"
                raise ParameterError(name, f"{name} must be above {after}, {limit:g} s, got {found}")

    def start(self) -> None:
        """Begin in COAST, without a frame."""
        self.newest = -math.inf
        self.now = COAST
        begin(self.stamps)

    def output(
        self, stamp: float, valid: bool, trouble: int, contradicted: bool, time: float
    ) -> tuple[int, int, float, bool, bool]:
        """Return state, reason, age, whether the age is too great, and whether vision has just come back."""
        self.verdict, self.moment = judge(self.stamps, stamp, time, self.restart)
        made = self.moment if self.verdict == NEWS and not math.isnan(stamp) else -math.inf
        newest, good, first, row = _counted(
            made, valid and not contradicted, self.newest, self.good, self.first, self.row, self.coast
        )
        age = time - good
        stale = bool(row == 0 or passed(age, self.coast))
        proven = bool(row >= self.frames and reached(good - first, self.proof))
        state = _state(self.now, stale, proven, time - self.since, self.level, self.land)
        self.newest_now, self.good_now, self.first_now = newest, good, first
        self.row_now, self.state_now = 0 if stale else row, state
        self.cause_now = trouble_of(self.verdict, self.cause)
        if state == FRESH:
            reason = NONE
        elif not stale:
            reason = REARMING
        elif trouble != NONE:
            reason = trouble
        elif passed(time - newest, self.coast):
            reason = max(self.cause_now, NO_FRAMES)
        else:
            reason = CONTRADICTED if contradicted else TARGET_LOST
        return state, reason, age, stale, state == FRESH and self.now != FRESH

    def update(self, stamp: float, time: float) -> None:
        """Keep the state."""
        keep(self.stamps, stamp, time, self.restart, self.verdict, self.moment)
        self.cause, self.now, self.row = self.cause_now, self.state_now, self.row_now
        self.newest, self.good, self.first = self.newest_now, self.good_now, self.first_now
        if self.now == FRESH or self.clock == OF_FRAME:
            self.since = self.good


def _counted(
    made: float, well: bool, newest: float, good: float, first: float, row: int, longest: float
) -> tuple[float, float, float, int]:
    """Return the instants of the newest and the last good frame, and the begin and length of the good row.

    ``made`` is the instant of a new frame; -inf if there is no new frame.
    """
    if made == -math.inf:
        return newest, good, first, row
    if not well:
        return made, good, first, row
    if row == 0 or passed(made - good, longest):
        return made, made, made, 1
    return made, made, first, row + 1


def _state(state: int, stale: bool, proven: bool, gone: float, level: float, land: float) -> int:
    """Return the next state; ``gone`` is the time without vision."""
    if not stale:
        return FRESH if proven or state == FRESH else state
    if state == FRESH:
        return COAST
    if state == COAST and passed(gone, level):
        return LEVEL
    if state == LEVEL and passed(gone, land):
        return LAND
    return state
