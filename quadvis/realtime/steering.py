"""Steering: what the supervisor of a run does for the helm, if the run has one."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING

from quadvis.diagram.times import LONGEST, time_text
from quadvis.engine.tuning import Change
from quadvis.graph.graph import MULTI, Graph
from quadvis.native.executor import last_exact
from quadvis.realtime.helm import ENDLESS, READY, RUNNING, Helm
from quadvis.realtime.member import Member
from quadvis.realtime.pictures import Picture
from quadvis.realtime.profiles import BlockTimes
from quadvis.realtime.ring import IN_ORDER, Words
from quadvis.realtime.times import TaskTimes
from quadvis.realtime.tuner import BEFORE, Tuner

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

PACE = 5e-4  # by how much of the time the ticks may be moved
LONGEST_MOVE = 10**8  # ns for which they are moved at once, at most
NEAR = 1e-3  # s between two looks at the box of a loop whose tick is long due
SOON = 1e-4  # s, the same around the moment at which it is due; and how much later the first look comes


class Steering:
    """Does for the members of a run what a helm asks; without a helm the run begins by itself.

    QuadvisError if the helm has steered another run.
    """

    def __init__(self, helm: Helm | None, diagram: Diagram, changed: Callable[[Change], None]) -> None:
        self._helm, self._changed = helm, changed
        self._period, self._written = diagram.graph.tick, diagram.ticks
        self._members: Sequence[Member] = ()
        self._tuner: Tuner | None = None
        self._begun = False
        self._reached = 0
        self._shift, self._moved = 0, time.monotonic_ns()
        self._measurement = 0
        self._late = _most_late(diagram.graph)
        self.ticks = diagram.ticks
        if helm is not None:
            helm.follow(self)

    def take_over(self, members: Sequence[Member]) -> None:
        """Steer these members, which have not begun."""
        self._members = members

    @property
    def is_watched(self) -> bool:
        """True if somebody may want to see pictures of the run."""
        return self._helm is not None

    @property
    def sources(self) -> list[int]:
        """What becomes ready when there is something to do."""
        return [self._helm.descriptor] if self._helm is not None and self._tuner is not None else []

    @property
    def pause(self) -> float:
        """How long (s) the supervisor may wait before it calls `look`; `inf` if nobody waits for a tick."""
        waits_for = self._tuner.waits_for if self._begun and self._tuner is not None else ()
        left = min((each.remaining for each in self._members if each.computer in waits_for), default=math.inf)
        return NEAR if left < -NEAR else max(0.0, left) + SOON

    @property
    def tick(self) -> int:
        """The last tick that every computer has begun."""
        return min((member.tick for member in self._members), default=0)

    @property
    def time(self) -> float:
        """Its time (s)."""
        return float(self.tick * self._period)

    def times(self) -> Mapping[str, tuple[TaskTimes, ...]]:
        """Return the times of the tasks of each computer."""
        return {member.computer: member.times() for member in self._members}

    def block_times(self) -> Mapping[str, BlockTimes]:
        """Return what the measurement that began last has found, by computer."""
        found = {member.computer: member.block_times() for member in self._members}
        return {computer: times for computer, times in found.items() if times is not None}

    def picture(self, path: str, port: str) -> Picture | None:
        """Return the newest picture of a signal."""
        return next(
            (each.picture(path, port) for each in self._members if each.has_picture(path, port)), None
        )

    @property
    def is_stopped(self) -> bool:
        """True if all members, which are ready, are to end."""
        return self._helm is not None and self._helm.is_stopped and self._tuner is not None

    def may_begin(self) -> bool:
        """Return whether the members, which are ready, may begin; from now on values can be checked."""
        if self._helm is None:
            return True
        if self._tuner is None:
            self._tuner = Tuner(
                {each.computer: each.tuned() for each in self._members}, self._period, self._changed
            )
            self._helm.enter(READY)
        self.look()
        return self._helm.is_begun and not self._helm.is_stopped

    def begin(self) -> None:
        """Give the members what they need before their first tick."""
        if self._helm is not None and self._tuner is not None:
            self.ticks = self._wanted_ticks(self._helm.stop_time)
            for member in self._members:
                member.end_at(self.ticks)
            self.look()
            self._tuner.send(BEFORE)
            self._helm.enter(RUNNING)
        self._begun = True

    @property
    def instant(self) -> int | None:
        """When the members are to begin (ns); None for as soon as they are ready."""
        return self._helm.instant if self._helm is not None else None

    def began(self, start: int) -> None:
        """Note when tick 0 is due, on the monotonic clock (ns)."""
        if self._helm is not None:
            self._helm.start_at(start)

    def attend(self) -> None:
        """Do as `look`, if somebody waits: rows are handed on for a while, and nobody is to wait for that."""
        asked = self._helm is not None and self._helm.is_asked
        if self._begun and self._tuner is not None and (asked or self._tuner.waits_for):
            self.look()

    def look(self) -> None:
        """Take what the helm wants, and answer it."""
        if self._helm is None or self._tuner is None:
            return
        if self._helm.shift != self._shift:
            self._approach(self._helm.shift)
        if self._helm.measurement != self._measurement:
            self._measurement = self._helm.measurement
            for member in self._members:
                member.measure(self._measurement)
        self._tuner.answer()
        for wanted in self._helm.take():
            self._tuner.offer(wanted, self.tick)
        if self._begun:
            self._tuner.send(max(member.tick for member in self._members))

    def _approach(self, wanted: int) -> None:
        """Move the ticks of the members towards a shift, as fast as they may."""
        now = time.monotonic_ns()
        most = int(min(now - self._moved, LONGEST_MOVE) * PACE)
        self._moved = now
        self._shift += max(-most, min(most, wanted - self._shift))
        for member in self._members:
            member.shift(self._shift)

    def settle(self, reached: int, *, last: bool = False) -> None:
        """Note how far the rows are that have been handed on, after a look at the rings.

        ``reached`` is the tick before that look. A look hands on what was there then, or, on some processors,
        at the look before.
        """
        if self._helm is None or not self._begun:
            return
        for member in self._members:
            member.rest()
        sure = reached if IN_ORDER else self._reached
        self._helm.settle(reached + 1 if last else max(0, sure - self._late))
        self._reached = reached

    @property
    def is_safe_first(self) -> bool:
        """True if the outputs are to be safe before the members end."""
        return self._helm is not None and self._helm.is_safe_first

    def noted(self, computer: str, records: Words) -> None:
        """Take the groups of values that a loop has noted, and their ticks."""
        if self._tuner is not None:
            self._tuner.noted(computer, records)

    def lose(self, computer: str) -> None:
        """Wait no more for a computer without which the others fly on."""
        if self._tuner is not None:
            self._tuner.lose(computer)

    def end(self) -> None:
        """End the steering; the members have ended."""
        if self._tuner is not None:
            self._tuner.end()
        if self._helm is not None:
            self._helm.end()

    def early(self) -> tuple[str, float | None]:
        """Say how a run without an error came to end at another time than its diagram says, and when (s).

        That is "" and None if it did not. A run that was stopped ended at the last tick that a computer has
        begun.
        """
        if any(member.stopped for member in self._members):
            begun = any(member.running for member in self._members)
            last = float(max(member.tick for member in self._members) * self._period)
            return f"it was stopped at t = {last:.9g} s" if begun else "it was stopped before its start", last
        if self.ticks == self._written:
            return "", None
        end = (self.ticks - 1) * self._period
        return f"its stop time was set to {time_text(end)}", float(end)

    def _wanted_ticks(self, stop_time: Fraction | float | None) -> int:
        if stop_time is None:
            return self._written
        most = max(self._written, min(last_exact(self._period) - 1, int(LONGEST / self._period)))
        if stop_time == ENDLESS:
            return most
        return min(most, int(Fraction(stop_time) / self._period) + 1)


def _most_late(graph: Graph) -> int:
    """Return how many ticks after its own a row may come at the latest, since its task runs by itself.

    A step that takes longer than two periods of its task has cost it overruns.
    """
    if graph.tasking != MULTI:
        return 0
    return int(2 * max(task.period for task in graph.tasks) / graph.tick)
