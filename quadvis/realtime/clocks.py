"""The monotonic clock for the pacer: interpreted, an object of Python; compiled, words with addresses."""

from __future__ import annotations

import ctypes
import os
import signal
import time
from collections.abc import Mapping
from typing import Any, Protocol

from quadvis.native.foreign import system
from quadvis.realtime.schedule import NANOSECONDS
from quadvis.realtime.words import address_of, whole_words

CLOCK_MONOTONIC, TIMER_ABSTIME = 1, 1
# Words of a clock in machine code: addresses of functions, the start and the time to poll (ns), a timespec.
GET, WAIT, START, POLLED, TIMESPEC, SECONDS, REST = range(7)
# The end of a pipe into which a signal puts a byte, or -1; the function that reads, and where to.
PIPE, READ, BUFFER, BYTE = range(7, 11)
BASE = 11  # the start as it was given; START is moved from there
WORDS = 12


class Timekeeper(Protocol):
    """Instants are nanoseconds since the start."""

    words: Any  # the same clock in machine code

    def now(self) -> int:
        """Return the present instant."""

    def sleep(self, instant: int) -> None:
        """Wait until an instant, or until a signal comes."""

    def follow(self, shift: int) -> None:
        """Let the instant 0 be so much (ns) after the start that was given."""

    def unshifted(self) -> int:
        """Return the time (ns) since the start that was given: durations are differences of such times."""


class MonotonicClock:
    """Linux's monotonic clock, which nobody can set; a wait sleeps at first and polls at its end.

    ``start`` is the instant 0 and ``polled`` the time before the end at which the sleep is over (ns).
    """

    def __init__(self, start: int = 0, polled: int = 0) -> None:
        library = ctypes.CDLL(None)
        self._call = library.clock_nanosleep
        self.words = machine_words(library.clock_gettime, library.clock_nanosleep)
        timespec = ctypes.c_void_p(self.words[TIMESPEC])
        self._arguments = (CLOCK_MONOTONIC, TIMER_ABSTIME, timespec, None)
        self.start, self.polled = start, polled

    @property
    def start(self) -> int:
        """The instant 0 on Linux's clock (ns)."""
        return int(self.words[START])

    @start.setter
    def start(self, start: int) -> None:
        self.words[START] = self.words[BASE] = start

    def follow(self, shift: int) -> None:
        """Let the instant 0 be so much (ns) after the start that was given."""
        self.words[START] = self.words[BASE] + shift

    def unshifted(self) -> int:
        """Return the time (ns) since the start that was given."""
        return time.monotonic_ns() - int(self.words[BASE])

    @property
    def polled(self) -> int:
        """How long (ns) a wait looks at the clock at its end."""
        return int(self.words[POLLED])

    @polled.setter
    def polled(self, polled: int) -> None:
        self.words[POLLED] = polled

    def hear_signals(self) -> None:
        """Let waits in machine code notice signals for which this thread, the main one, has handlers."""
        reading, writing = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
        self.words[READ] = ctypes.cast(ctypes.CDLL(None).read, ctypes.c_void_p).value or 0
        self.words[PIPE] = reading

    def now(self) -> int:
        """Return the present instant."""
        return time.monotonic_ns() - self.start

    def sleep(self, instant: int) -> None:
        """Wait until an instant, or until a signal comes."""
        end = instant + self.start
        wake = end - self.polled
        if time.monotonic_ns() < wake:
            self.words[SECONDS], self.words[REST] = divmod(wake, NANOSECONDS)
            if self._call(*self._arguments):
                return
        while time.monotonic_ns() < end:
            pass


def machine_words(get: Any, wait: Any) -> Any:
    """Return the words of a clock from functions that are as C's clock_gettime and clock_nanosleep."""
    words = whole_words(WORDS)
    words[GET], words[WAIT] = (ctypes.cast(each, ctypes.c_void_p).value or 0 for each in (get, wait))
    words[PIPE] = -1
    return for_thread(words)


def for_thread(words: Any) -> Any:
    """Return the words of the same clock for another thread: no two may use the same."""
    found = whole_words(WORDS)
    found[:] = words
    found[TIMESPEC], found[BUFFER] = address_of(found[SECONDS:]), address_of(found[BYTE:])
    return found


def now(clock: Any) -> int:
    """Return the present instant."""
    return int(clock.now())


def sleep(clock: Any, instant: int) -> None:
    """Wait until an instant, or until a signal comes."""
    clock.sleep(instant)


def follow(clock: Any, shift: int) -> None:
    """Let the instant 0 be so much (ns) after the start that was given."""
    clock.follow(shift)


def unshifted(clock: Any) -> int:
    """Return the time (ns) since the start that was given."""
    return int(clock.unshifted())


def signalled(_: Any) -> bool:
    """Return whether a signal waits for Python: never while Python runs."""
    return False


def _machine_now(words: Any) -> int:
    system(words[GET], CLOCK_MONOTONIC, words[TIMESPEC], 0, 0)
    found: int = words[SECONDS] * NANOSECONDS + words[REST] - words[START]
    return found


def _machine_sleep(words: Any, instant: int) -> None:
    wake = instant - words[POLLED]
    if _machine_now(words) < wake:
        wake += words[START]
        words[SECONDS], words[REST] = wake // NANOSECONDS, wake % NANOSECONDS
        if system(words[WAIT], CLOCK_MONOTONIC, TIMER_ABSTIME, words[TIMESPEC], 0) != 0:
            return
    while _machine_now(words) < instant:
        pass


def _machine_follow(words: Any, shift: int) -> None:
    words[START] = words[BASE] + shift


def _machine_unshifted(words: Any) -> int:
    found: int = _machine_now(words) + words[START] - words[BASE]
    return found


def _machine_signalled(words: Any) -> bool:
    if words[PIPE] < 0:
        return False
    return system(words[READ], words[PIPE], words[BUFFER], 1, 0) == 1


# What stands for these functions in machine code.
MACHINE: Mapping[Any, Any] = {
    now: _machine_now, sleep: _machine_sleep, follow: _machine_follow, unshifted: _machine_unshifted,
    signalled: _machine_signalled,
}  # fmt: skip
