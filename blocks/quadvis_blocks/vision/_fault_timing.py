"""Faults between a camera and the blocks behind it: the times at which frames come, and their stamps."""

from __future__ import annotations

import math

from quadvis.block import reached

NO_FAULT = "none"
LATE = 3  # ticks by which a late frame is late, and an outdated picture is old

# Kinds that concern times and stamps, and not the content of a picture.
TIMING = (
    "drop",  # no frame comes
    "bursts",  # three frames come, three do not
    "freeze",  # the last picture again and again, under new stamps and numbers
    "alternate",  # the last two pictures by turns, under new stamps and numbers
    "stutter",  # every other frame has the picture of the frame before
    "late",  # frames come three ticks later, with the stamps that they had
    "outdated",  # pictures of three ticks ago, under present stamps
    "swap",  # neighbouring frames change places
    "repeated_stamp",  # the stamp stands still
    "back_stamp",  # 1 s too old
    "falling_stamp",  # stamps fall as fast as the time rises
    "future_stamp",  # 1000 s ahead
    "nan_stamp",
    "inf_stamp",
    "lagging_stamp",  # 0.3 s too old
    "clock_restart",  # stamps count from the beginning of the fault
    "wild_stamp",  # by turns ahead, NaN, too old, right, infinite
)


def is_on(time: float, begin: float, duration: float) -> bool:
    """Return whether the fault is active."""
    return bool(reached(time, begin) and not reached(time, begin + duration))


def comes(kind: str, count: int) -> int:
    """Return the age (ticks) of the frame on the wire at tick `count`; -1: the frame shown before stays."""
    if kind == "drop" or (kind == "bursts" and count % 6 < 3):
        return -1
    if kind == "late":
        return LATE if count >= LATE else -1
    if kind == "swap":
        # The second frame of a pair goes first, so the first pair begins a tick late.
        if count == 0:
            return -1
        return 0 if count % 2 == 1 else 2
    return 0


def shows(kind: str, count: int) -> int:
    """Return the age (ticks) of the picture of a frame; -1: the last picture shown; -2: the last but one."""
    if kind == "alternate":
        return -2
    if kind == "freeze" or (kind == "stutter" and count % 2 == 0):
        return -1
    return LATE if kind == "outdated" else 0


def stamped(kind: str, stamp: float, count: int, period: float, begin: float, shown: float) -> float:
    """Return the stamp of a frame with the fault; `shown` is the stamp of the frame shown before."""
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
