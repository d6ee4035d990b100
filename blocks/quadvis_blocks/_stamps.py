"""Which stamp is news, and how old a stamp is: the one rule of all blocks that take a stamp.

A stamp is the instant (s, run time) at which a value was measured or made, according to its sender. Senders
err, so each stamp gets a verdict:

========= ============================================================ =========================
verdict   a stamp that                                                 counts
========= ============================================================ =========================
NEWS      is later than all that counted, and not ahead of the time    as it stands
REPEATED  equals the stamp seen last                                   no
BACK      is not later than one that counted: overtaken on its way     no
AHEAD     is ahead of the time                                         no
MISSING   is NaN or infinite                                           no
RESTARTED is of a clock that was set back or started again             no; as NEWS after a while
========= ============================================================ =========================

A restarted clock is accepted in four steps:

1. Its stamps form a row: they are earlier than the last stamp that counted, and they rise as fast as the
   time. A stamp that counts ends the row.
2. When the row has lasted a quarter of ``restart``, its stamps are RESTARTED, even if the row has caught up
   with the last stamp that counted: the row of a clock that was set back by 0.3 s does so after 0.3 s.
3. When the row has lasted ``restart``, its clock is accepted: its stamps count as NEWS. They are shifted, so
   that their age at arrival is the age of the stamps that counted before.
4. The shift ends with the first stamp that is later than all that counted and fits the time without it.

A clock that is ahead of the time is never accepted, however its stamps rise.

Before the first finite stamp, NaN means that there is no clock: each tick brings a value that was measured at
that tick. A block keeps a clock, an array (`SIZE`,), as one of its states. It calls `begin` in ``start``,
`judge` in ``output`` and `keep` in ``update``; if ``output`` does not judge, it calls `note` in ``update``.
The age of a value counts from the instant that `judge` returns. This instant is never after the arrival, so
the age is the larger one of the age by stamp and the age by arrival.
"""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import passed, reached

RESTART = 1.0  # s; how long a restarted clock must run before it is accepted
NEWS, REPEATED, BACK, AHEAD, MISSING, RESTARTED = range(6)

SIZE = 7
SEEN = 0  # the last finite stamp; NaN before the first
MADE = 1  # the instant of the last stamp that counted
SHIFT = 2  # run time minus stamp, of an accepted clock that was restarted; else 0
DELAY = 3  # the time from MADE to the arrival of that stamp
ROW = 4  # arrival of the first stamp of the row; NaN if there is no row
ROW_AGE = 5  # least age at arrival in the row, by the row's own clock
ROW_LAST = 6  # the last stamp of the row


def begin(clock: Any) -> None:
    """Begin without a stamp."""
    clock[SEEN] = math.nan
    clock[MADE] = -math.inf
    clock[SHIFT] = 0.0
    clock[DELAY] = 0.0
    clock[ROW] = math.nan
    clock[ROW_AGE] = 0.0
    clock[ROW_LAST] = 0.0


def judge(clock: Any, stamp: float, time: float, restart: float) -> tuple[int, float]:
    """Return the verdict on a stamp at a time (s), and the instant of the stamp; -inf if it has none."""
    if not math.isfinite(stamp):
        if math.isnan(stamp) and math.isnan(clock[SEEN]):
            return NEWS, time
        return MISSING, -math.inf
    if stamp == clock[SEEN]:
        return REPEATED, -math.inf
    made = _instant(clock, stamp, time)
    fits = clock[MADE] < made and reached(time, made)
    if _in_row(clock, stamp, time, restart):
        lasted = time - clock[ROW]
        nearer = abs(time - stamp - clock[ROW_AGE]) < abs(time - made - clock[DELAY])
        if reached(lasted, 0.25 * restart) and (nearer or not fits):
            if not reached(lasted, restart):
                return RESTARTED, -math.inf
            return NEWS, stamp + min(clock[ROW_AGE], time - stamp) - clock[DELAY]
    if fits:
        return NEWS, min(made, time)
    return (AHEAD, -math.inf) if passed(made, time) else (BACK, made)


def note(clock: Any, stamp: float, time: float, restart: float) -> tuple[int, float]:
    """Judge and keep a stamp; return the result of `judge`."""
    verdict, made = judge(clock, stamp, time, restart)
    keep(clock, stamp, time, restart, verdict, made)
    return verdict, made


def keep(clock: Any, stamp: float, time: float, restart: float, verdict: int, made: float) -> None:
    """Keep a stamp, with the result of `judge` at this time."""
    if not math.isfinite(stamp):
        return
    if verdict == NEWS:
        clock[SHIFT] = made - stamp if passed(abs(made - stamp), 0.0) else 0.0
        clock[MADE] = made
        clock[DELAY] = time - made
        clock[ROW] = math.nan
    elif verdict in (BACK, RESTARTED):
        if _in_row(clock, stamp, time, restart):
            clock[ROW_AGE] = min(clock[ROW_AGE], time - stamp)
        else:
            clock[ROW] = time
            clock[ROW_AGE] = time - stamp
        clock[ROW_LAST] = stamp
    clock[SEEN] = stamp


def _instant(clock: Any, stamp: float, time: float) -> float:
    """Return the instant of a stamp: the stamp itself or the shifted stamp, whichever fits better."""
    shifted = float(stamp + clock[SHIFT])
    plain = clock[MADE] < stamp and reached(time, stamp)
    if not plain:
        return stamp if passed(shifted, time) and reached(time, stamp) else shifted
    if passed(shifted, time) or abs(time - stamp - clock[DELAY]) < abs(time - shifted - clock[DELAY]):
        return stamp
    return shifted


def _in_row(clock: Any, stamp: float, time: float, restart: float) -> bool:
    """Return whether a stamp continues the row: it is later, and rises as fast as the time."""
    if math.isnan(clock[ROW]) or stamp <= clock[ROW_LAST]:
        return False
    return bool(abs(time - stamp - clock[ROW_AGE]) <= 0.25 * restart)
