"""The helm of a real-time run: another thread of the supervisor's process begins, tunes and stops it."""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from fractions import Fraction
from typing import NamedTuple, Protocol

from quadvis.diagram.times import read_duration
from quadvis.document import YamlScalar
from quadvis.engine.profile import started
from quadvis.engine.tuning import NewValue
from quadvis.errors import QuadvisError
from quadvis.realtime.pictures import Picture
from quadvis.realtime.profiles import BlockTimes
from quadvis.realtime.times import TaskTimes

STARTING, READY, RUNNING, ENDED = STATES = ("starting", "ready", "running", "ended")
ENDLESS = math.inf  # a stop time


class Progress(Protocol):
    """How far a run is."""

    @property
    def tick(self) -> int:
        """Return the last tick that every computer has begun."""

    @property
    def time(self) -> float:
        """Return its time (s)."""

    def times(self) -> Mapping[str, tuple[TaskTimes, ...]]:
        """Return the times of the tasks of each computer."""

    def block_times(self) -> Mapping[str, BlockTimes]:
        """Return the times of the blocks of each computer, if they were asked for."""

    def picture(self, path: str, port: str) -> Picture | None:
        """Return the newest picture of a signal; None if there is none."""


@dataclass(frozen=True)
class Stand:
    """A progress that does not go on."""

    tick: int = 0
    time: float = 0.0
    found: Mapping[str, tuple[TaskTimes, ...]] = field(default_factory=dict)
    blocks: Mapping[str, BlockTimes] = field(default_factory=dict)

    def times(self) -> Mapping[str, tuple[TaskTimes, ...]]:
        """Return the times of the tasks of each computer."""
        return self.found

    def block_times(self) -> Mapping[str, BlockTimes]:
        """Return the times of the blocks of each computer."""
        return self.blocks

    def picture(self, path: str, port: str) -> Picture | None:
        """Return None."""
        return None


class RunWatch(Protocol):
    """Who hears of a run as it goes on, in the supervisor's thread."""

    def entered(self, state: str) -> None:
        """Take the run's new state."""

    def settled(self, tick: int) -> None:
        """Take the first tick of which rows may still come."""


class Wanted(NamedTuple):
    """A group of new values that is to hold from one tick on, and who waits for that tick."""

    group: tuple[NewValue, ...]
    future: Future[int]


class Helm:
    """Steers one real-time run; its methods can be called in any thread.

    A run with a helm gets ready, and waits until `begin`. ``stop_time`` (s, or a text such as "20 s"; `inf`
    for a run without end) replaces that of the diagram, and can be set until then. A run without end has as
    many ticks as its engine counts exactly, at most 1e9 s. ``watch`` hears of the run.
    """

    def __init__(
        self, stop_time: str | float | Fraction | None = None, watch: RunWatch | None = None
    ) -> None:
        self._watch = watch
        self._lock = threading.Lock()
        self._wake = os.eventfd(0, os.EFD_NONBLOCK | os.EFD_CLOEXEC)
        self._wanted: list[Wanted] = []
        self._begun = self._stopped = self._safe = False
        self._state = STARTING
        self._instant: int | None = None
        self._began: int | None = None
        self.shift = self.measurement = 0
        self._progress: Progress = Stand()
        self._stop_time: Fraction | float | None = None
        self.stop_time = stop_time

    @property
    def state(self) -> str:
        """What the run does: "starting", "ready", "running" or "ended"."""
        return self._state

    @property
    def tick(self) -> int:
        """The last tick that every computer has begun."""
        return self._progress.tick

    @property
    def time(self) -> float:
        """The time of this tick (s)."""
        return self._progress.time

    @property
    def began(self) -> int | None:
        """The instant of tick 0 (ns since 1970, as this computer knew it then); None before it is set."""
        return self._began

    def times(self) -> Mapping[str, tuple[TaskTimes, ...]]:
        """Return the times of the tasks up to now, by computer ("" in a diagram without computers)."""
        return self._progress.times()

    def measure(self, on: bool) -> None:
        """Let the calls of blocks be timed from the next steps on, anew, or no more; the run goes on.

        Meanwhile each call takes a little longer, see `ProfileReport.cost`.
        """
        with self._lock:
            began = started(self.measurement)
            self.measurement = began + 2 if on else began + 1
            self._call()

    def block_times(self) -> Mapping[str, BlockTimes]:
        """Return what was found since `measure`, by computer ("" in a diagram without computers)."""
        return self._progress.block_times()

    def picture(self, path: str, port: str) -> Picture | None:
        """Return the newest picture of a signal; None if there is none.

        The loop gives pictures a few times a second, as long as somebody asks for them.
        """
        return self._progress.picture(path, port)

    @property
    def stop_time(self) -> Fraction | float | None:
        """The stop time (s): `inf` for none, None for that of the diagram."""
        return self._stop_time

    @stop_time.setter
    def stop_time(self, given: str | float | Fraction | None) -> None:
        """Set it; QuadvisError if it is no time of a run, or if the run has begun."""
        endless = given == ENDLESS or (isinstance(given, str) and given.strip() == "inf")
        text = given if isinstance(given, str) else f"{given} s"
        found = None if given is None else ENDLESS if endless else read_duration(_scalar(text))
        with self._lock:
            if self._begun:
                raise QuadvisError("the run has begun, so its stop time stands; stop it instead")
            self._stop_time = found

    def begin(self, instant: int | None = None) -> None:
        """Let the run begin as soon as it is ready, or at an instant (ns) of the monotonic clock."""
        with self._lock:
            self._begun, self._instant = True, instant
            self._call()

    def align(self, shift: int) -> None:
        """Let each tick be due so much (ns) later than it was by the start.

        The loops come there slowly, by half a millisecond a second, so that no tick is lost.
        """
        self.shift = shift

    def stop(self, *, safe_first: bool = False) -> None:
        """Let the run end before its next step: an orderly end, with safe values, and no error.

        With ``safe_first`` the guardian does not wait for that step. A run that is starting ends when it
        would be ready.
        """
        with self._lock:
            self._stopped, self._safe = True, safe_first or self._safe
            self._call()

    def tune(self, group: Sequence[NewValue]) -> Future[int]:
        """Let parameters have new values together; the result is the tick from which on they hold.

        On several computers that is one tick for all. Values that come before `begin` hold from the first
        tick on. ParameterError in the future if a value is refused, and then no value of the group changes;
        QuadvisError if the run ends before.
        """
        wanted = Wanted(tuple(group), Future())
        with self._lock:
            if self._state != ENDED:
                self._wanted.append(wanted)
                self._call()
                return wanted.future
        wanted.future.set_exception(too_late())
        return wanted.future

    def _call(self) -> None:
        """Wake the supervisor."""
        if self._wake >= 0:
            os.eventfd_write(self._wake, 1)

    # What follows is for the supervisor.

    @property
    def descriptor(self) -> int:
        """What becomes readable when there is something to do."""
        return self._wake

    @property
    def is_begun(self) -> bool:
        """True once the run may begin."""
        return self._begun

    @property
    def instant(self) -> int | None:
        """When the run is to begin (ns); None for as soon as it is ready."""
        return self._instant

    def start_at(self, start: int) -> None:
        """Note when tick 0 is due, on the monotonic clock (ns)."""
        self._began = start + time.time_ns() - time.monotonic_ns()

    @property
    def is_stopped(self) -> bool:
        """True once the run is to end."""
        return self._stopped

    @property
    def is_safe_first(self) -> bool:
        """True once the outputs are to be safe before the loops end."""
        return self._safe

    def settle(self, tick: int) -> None:
        """Note that no rows come any more of the ticks before one."""
        if self._watch is not None:
            self._watch.settled(tick)

    @property
    def is_asked(self) -> bool:
        """True if groups have come since the last `take`."""
        return bool(self._wanted)

    def take(self) -> list[Wanted]:
        """Return the groups that have come since the last call."""
        with self._lock:
            try:
                os.eventfd_read(self._wake)
            except BlockingIOError:
                return []
            found, self._wanted = self._wanted, []
            return found

    def follow(self, progress: Progress) -> None:
        """Show the progress of a run from now on; QuadvisError if it had another one before."""
        if self._state != STARTING or not isinstance(self._progress, Stand):
            raise QuadvisError("this helm has steered another run; give each run a helm of its own")
        self._progress = progress

    def enter(self, state: str) -> None:
        """Note that the run is in another state."""
        self._state = state
        if self._watch is not None:
            self._watch.entered(state)

    def end(self) -> None:
        """Note that the run has ended; who still waits for a tick gets an error."""
        now = self._progress
        with self._lock:
            self._progress = Stand(now.tick, now.time, now.times(), now.block_times())
            self._state = ENDED
            late, self._wanted = self._wanted, []
            if self._wake >= 0:
                os.close(self._wake)
                self._wake = -1
        for each in late:
            if each.future.set_running_or_notify_cancel():
                each.future.set_exception(too_late())


def too_late() -> QuadvisError:
    """Return the error of values that come when nothing can take them any more."""
    return QuadvisError("the run has ended, so no parameter can change")


def _scalar(text: str) -> YamlScalar:
    return YamlScalar(text, False, "stop_time", 0, 0)
