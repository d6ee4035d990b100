"""What goes wrong between a camera and those who look: when frames come, and what stamps they have."""

from __future__ import annotations

import math

from quadvis.block import reached

NO_FAULT = "none"
LATE = 3  # ticks that a late frame is late, and an old picture is old

# Kinds for which time and stamps matter, and pictures do not.
TIMING = (
    "drop",  # no frame comes
    "bursts",  # three come, three do not
    "freeze",  # the last picture again and again, under new stamps and numbers
    "alternate",  # the last two pictures by turns, under new stamps and numbers
    "stutter",  # every other frame is the one before
    "late",  # frames come three ticks later, with the stamps that they had
    "outdated",  # pictures of three ticks ago under the stamps of now
    "swap",  # neighbours change places
    "repeated_stamp",  # the stamp stands still
    "back_stamp",  # 1 s too old
    "falling_stamp",  # time runs backwards
    "future_stamp",  # 1000 s ahead
    "nan_stamp",
    "inf_stamp",
    "lagging_stamp",  # 0.3 s too old
    "clock_restart",  # stamps count from the begin of the fault
    "wild_stamp",  # each other than the one before: ahead, NaN, from long ago, right
)


def is_on(time: float, begin: float, duration: float) -> bool:
    """Return whether the fault is there."""
    return bool(reached(time, begin) and not reached(time, begin + duration))


def comes(kind: str, count: int) -> int:
    """Return how many ticks ago the frame came that is on the wire at tick `count`; -1: the one shown."""
    if kind == "drop" or (kind == "bursts" and count % 6 < 3):
        return -1
    if kind == "late":
        return LATE if count >= LATE else -1
    if kind == "swap":
        # The second of a pair goes first; so the first pair begins a tick late.
        if count == 0:
            return -1
        return 0 if count % 2 == 1 else 2
    return 0


def shows(kind: str, count: int) -> int:
    """Return whose picture a frame has: of so many ticks ago; -1: the one that is shown; -2: before that."""
    if kind == "alternate":
        return -2
    if kind == "freeze" or (kind == "stutter" and count % 2 == 0):
        return -1
    return LATE if kind == "outdated" else 0


def stamped(kind: str, stamp: float, count: int, period: float, begin: float, shown: float) -> float:
    """Return the stamp of a frame that has the fault; `shown` is that of the frame before."""
    wild = (stamp + 1000.0, math.nan, stamp - 5.0, stamp, -math.inf, stamp + 0.5)
    stamps = {
        "repeated_stamp": shown,
        "back_stamp": stamp - 1.0,
        "falling_stamp": stamp - 2.0 * count * period,
        "future_stamp": stamp + 1000.0,
        "nan_stamp": math.nan,
        "inf_stamp": math.inf,
        "lagging_stamp": stamp - 0.3,
        "clock_restart": stamp - begin,
        "wild_stamp": wild[count % len(wild)],
    }
    return stamps.get(kind, stamp)
