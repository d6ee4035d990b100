"""Sleep and polling, interpreted and as machine code."""

from __future__ import annotations

import ctypes
import errno
import sys
from typing import Any

import numpy as np
import pytest

from quadvis.native.library import library
from quadvis.native.routine import Routine
from quadvis.realtime import clocks
from quadvis.realtime.clocks import MACHINE, MonotonicClock, machine_words, now, sleep
from quadvis.realtime.schedule import NANOSECONDS
from quadvis.realtime.system import wake_up_time
from quadvis.realtime.words import address_of
from tests.quadvis.realtime.fakes import C_FUNCTION, Timespec

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="the clock is Linux's")


class System:
    """Linux's clock, and sleep, in steps of 10 us; a sleep is some time late."""

    def __init__(self, late: int) -> None:
        self.instant, self.late, self.slept, self.interrupts = 0, late, [], False

    def monotonic_ns(self) -> int:
        self.instant += 10_000
        return self.instant

    def gettime(self, clock: int, place: int, _: int, __: int) -> int:
        assert clock == 1
        Timespec.from_address(place).put(self.monotonic_ns())
        return 0

    def nanosleep(self, clock: int, flags: int, place: int, rest: int) -> int:
        assert (clock, flags, rest) == (1, 1, 0)
        if self.interrupts:
            return errno.EINTR
        self.slept.append(Timespec.from_address(place).value)
        self.instant = max(self.instant, self.slept[-1]) + self.late
        return 0


class Interpreted(MonotonicClock):
    """The clock of Python over a system that is not Linux."""

    def __init__(self, system: System, polled: int = 0) -> None:
        super().__init__(polled=polled)
        self._call = lambda clock, flags, place, rest: system.nanosleep(clock, flags, place.value, rest or 0)


class Compiled:
    """The same clock by its words alone."""

    def __init__(self, system: System, polled: int = 0) -> None:
        self._functions = C_FUNCTION(system.gettime), C_FUNCTION(system.nanosleep)
        self.words = machine_words(*self._functions)
        self.words[clocks.POLLED] = polled
        self._argument = np.zeros(1, np.int64)
        self._places = np.array([address_of(self.words), self._argument.ctypes.data], np.int64)

    def _run(self, function: Any) -> int:
        address = library().routine(Routine(function, "ww", MACHINE))
        ctypes.CFUNCTYPE(ctypes.c_int32, ctypes.c_void_p)(address)(self._places.ctypes.data)
        return int(self._argument[0])

    def now(self) -> int:
        return self._run(_now)

    def sleep(self, instant: int) -> None:
        self._argument[0] = instant
        self._run(_sleep)


def _now(clock: Any, result: Any) -> None:
    result[0] = now(clock)


def _sleep(clock: Any, instant: Any) -> None:
    sleep(clock, instant[0])


@pytest.fixture
def system(monkeypatch: pytest.MonkeyPatch) -> System:
    made = System(70_000)
    monkeypatch.setattr(clocks, "time", made)
    return made


kinds = pytest.mark.parametrize("kind", [Interpreted, Compiled])


@kinds
def test_the_end_of_a_wait_is_polled(kind: Any, system: System) -> None:
    kind(system, 100_000).sleep(5 * NANOSECONDS)
    assert system.slept == [5 * NANOSECONDS - 100_000]
    assert system.instant == 5 * NANOSECONDS
    kind(system).sleep(6 * NANOSECONDS)
    assert system.instant > 6 * NANOSECONDS + 70_000


@kinds
def test_there_is_no_sleep_if_the_time_is_near_or_past(kind: Any, system: System) -> None:
    kind(system, 100_000).sleep(50_000)
    kind(system).sleep(0)
    assert system.slept == []


@kinds
def test_a_signal_ends_a_wait(kind: Any, system: System) -> None:
    system.interrupts = True
    kind(system, 100_000).sleep(NANOSECONDS)
    assert system.instant < NANOSECONDS


@kinds
def test_the_time_to_wake_up_is_measured(kind: Any, system: System) -> None:
    assert wake_up_time(kind(system)) == pytest.approx(80_000, abs=10_000)


def test_both_see_the_real_clock_and_wake_no_earlier_than_asked() -> None:
    interpreted = MonotonicClock()
    compiled = Compiled.__new__(Compiled)
    compiled.words = interpreted.words
    compiled._argument = np.zeros(1, np.int64)
    compiled._places = np.array([address_of(compiled.words), compiled._argument.ctypes.data], np.int64)
    for polled in (0, 50_000):
        interpreted.polled = polled
        for one, other in ((interpreted, compiled), (compiled, interpreted)):
            instant = other.now() + 2_000_000
            one.sleep(instant)
            assert other.now() >= instant
