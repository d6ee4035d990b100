"""Which stamp is news, and how old it is: the one rule of all blocks that take a stamp.

A stamp is the instant (s, run time) at which something was measured or made, as its sender says. Senders err:

========= ============================================================ =========================
verdict   a stamp that                                                 counts
========= ============================================================ =========================
NEWS      is later than all that counted, and not ahead of the time    as it stands
REPEATED  is the one seen last                                         no
BACK      is not later than one that counted: overtaken on its way     no
AHEAD     is ahead of the time                                          no
MISSING   is NaN or infinite                                           no
RESTARTED is of a clock that was set back or started again             no; as NEWS after a while
========= ============================================================ =========================

A clock that started again shows by stamps that rise as the time does, behind the one that counted last, while
nothing else counts. A row of them is RESTARTED once it lasts a quarter of ``restart``, even if it catches up
with what counted before: a clock that was set back by 0.3 s does after 0.3 s. When the row has lasted
``restart`` its clock is taken: its stamps are then shifted so that what comes is as old as what came before.
One stamp that fits the time again without that shift, and is newer, ends it. A clock that is ahead is never
taken, whatever it does.

Until the first finite stamp NaN means that there is no clock: what comes is of now, at each tick. A block
keeps a clock (`SIZE`,) as one of its states; `begin` in ``start``, `judge` in ``output``, `keep` in
``update``, or `note` there if ``output`` does not judge. Age counts from the instant that `judge` gives,
which is never after the arrival: of age by stamp and age by arrival that is the larger one.
"""

from __future__ import annotations

import math
from typing import Any

from quadvis.block import passed, reached

RESTART = 1.0  # s; how long a clock that started again must run before it is taken
NEWS, REPEATED, BACK, AHEAD, MISSING, RESTARTED = range(6)

SIZE = 7
SEEN = 0  # the last finite stamp; NaN before the first
MADE = 1  # what counted last: the instant that it stood for
SHIFT = 2  # run time less stamp of a clock that was taken again; else 0
DELAY = 3  # from that instant to its arrival
ROW = 4  # arrival of the first stamp of a row that lies behind; NaN if there is none
ROW_AGE = 5  # least age of a stamp of the row, by its own clock
ROW_LAST = 6  # its last stamp


def begin(clock: Any) -> None:
    """Know no stamp yet."""
    clock[SEEN] = math.nan
    clock[MADE] = -math.inf
    clock[SHIFT] = 0.0
    clock[DELAY] = 0.0
    clock[ROW] = math.nan
    clock[ROW_AGE] = 0.0
    clock[ROW_LAST] = 0.0


def judge(clock: Any, stamp: float, time: float, restart: float) -> tuple[int, float]:
    """Return what a stamp is at a time (s), and the instant that it stands for; -inf if for none."""
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
    """Keep a stamp that was not judged before, and return what `judge` does."""
    verdict, made = judge(clock, stamp, time, restart)
    keep(clock, stamp, time, restart, verdict, made)
    return verdict, made


def keep(clock: Any, stamp: float, time: float, restart: float, verdict: int, made: float) -> None:
    """Keep a stamp, and what `judge` has said of it at this time."""
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
    """Return the instant of a stamp: as it stands, or by the shift of its clock, whichever fits."""
    shifted = float(stamp + clock[SHIFT])
    plain = clock[MADE] < stamp and reached(time, stamp)
    if not plain:
        return stamp if passed(shifted, time) and reached(time, stamp) else shifted
    if passed(shifted, time) or abs(time - stamp - clock[DELAY]) < abs(time - shifted - clock[DELAY]):
        return stamp
    return shifted


def _in_row(clock: Any, stamp: float, time: float, restart: float) -> bool:
    """Return whether a stamp goes on with the row: later, and as the time does."""
    if math.isnan(clock[ROW]) or stamp <= clock[ROW_LAST]:
        return False
    return bool(abs(time - stamp - clock[ROW_AGE]) <= 0.25 * restart)
