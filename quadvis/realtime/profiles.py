"""The profiles of a running loop: shared words in which each of its threads notes the times of calls.

The supervisor writes the number of a measurement into a word of control, see `quadvis.engine.profile`. A
thread looks at it before each of its steps, and runs timed calls or plain ones from then on. So a loop that
is not measured calls its blocks as if there was no profile.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from quadvis.engine.profile import EVENTS, Profile, ProfileReport, TimedMethod
from quadvis.graph.graph import MULTI, Graph

CALLS = 50_000  # of each thread, whose instants are kept, if a run is not measured from its start on


class BlockTimes(NamedTuple):
    """What a measurement has found on a computer; its first call began ``offset`` ns after the start."""

    report: ProfileReport
    offset: int


class ProfileRoom(NamedTuple):
    """The size of all profiles of a loop: its blocks, its threads, and the calls that each keeps."""

    blocks: int
    threads: int
    calls: int

    @staticmethod
    def of(part: Graph, *, whole: bool) -> ProfileRoom:
        """Return what a computer needs; ``whole`` says that its run is measured from the start on."""
        threads = len(part.tasks) if part.tasking == MULTI else 1
        return ProfileRoom(len(part.nodes), threads, EVENTS if whole else CALLS)

    @property
    def words(self) -> int:
        """The number of words."""
        return self.threads * Profile.size(self.blocks, self.calls)


class ProfileBox:
    """The shared words of the profiles, for either side."""

    def __init__(self, words: Any, room: ProfileRoom) -> None:
        view, size = memoryview(words).cast("B").cast("q"), Profile.size(room.blocks, room.calls)
        self._profiles = [
            Profile(room.blocks, room.calls, view[size * number : size * (number + 1)])
            for number in range(room.threads)
        ]
        self._given = 0

    def new(self) -> Profile:
        """Return the profile of the next thread, for the loop."""
        self._given += 1
        return self._profiles[self._given - 1]

    def report(self, methods: Sequence[Sequence[TimedMethod]], measurement: int) -> ProfileReport | None:
        """Return what a measurement has found, for the supervisor; None if nothing yet."""
        return ProfileReport.of(zip(self._profiles, methods, strict=False), measurement)
