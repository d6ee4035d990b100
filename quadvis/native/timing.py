"""Calls of machine code that are measured one by one."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

from quadvis.engine.profile import Profile, record
from quadvis.native.foreign import invoke, system
from quadvis.native.routine import Routine

CLOCK_MONOTONIC = 1
NANOSECONDS = 10**9
# Words of the timing of a method: the function and its places; its number; clock_gettime, a timespec.
ADDRESS, PLACES, NUMBER, GET, TIMESPEC, SECONDS, REST = range(7)
WORDS = 7


def timed(call: Any, words: Any, events: Any) -> None:
    """Call a function and count its time; fail if it fails."""
    begin = _now(call)
    status = invoke(call[ADDRESS], call[PLACES])
    record(words, events, call[NUMBER], begin, _now(call) - begin)
    if status != 0:
        raise ValueError


def _now(call: Any) -> int:
    system(call[GET], CLOCK_MONOTONIC, call[TIMESPEC], 0, 0)
    instant: int = call[SECONDS] * NANOSECONDS + call[REST]
    return instant


TIMED = Routine(timed, "www")


class TimedCalls:
    """The words of the measured calls of one program; it must live as long as they are made."""

    def __init__(self, profile: Profile) -> None:
        from quadvis.native.library import library

        self.address = library().routine(TIMED)
        self._profile = profile
        self._get = ctypes.cast(ctypes.CDLL(None).clock_gettime, ctypes.c_void_p).value or 0
        self._kept: list[Any] = []

    def call(self, block: int, method: str, address: int) -> tuple[Any, list[int]]:
        """Return the words of a measured call of a function, and the places that `timed` takes."""
        number, words = self._profile.words(block, method)
        call = np.zeros(WORDS, np.int64)
        call[ADDRESS], call[NUMBER], call[GET] = address, number, self._get
        call[TIMESPEC] = call.ctypes.data + SECONDS * call.itemsize
        self._kept.append(call)
        shared = [np.frombuffer(each, np.int64).ctypes.data for each in (words, self._profile.events)]
        return call, [call.ctypes.data, *shared]
