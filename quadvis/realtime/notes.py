"""What a loop notes besides rows.

These are the ticks that it leaves out, the groups of parameters that it takes, what its tasks missed, and
their times. Each kind has a ring. All rings lie side by side in words, so that the loop takes one argument
for them, in Python and as machine code.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from quadvis.realtime.ring import PUT, RecordRing, place_in

ROOM = 4096  # records of each of the first three rings
LEFT_OUT = 0  # where the ring of the ticks that are left out begins; a record: the first, and how many
GROUPS = LEFT_OUT + RecordRing.size(ROOM, 2)  # taken from the parameter box; a record: the number, the tick
RELEASES = GROUPS + RecordRing.size(ROOM, 2)
# What dispatched tasks missed. A record: the number of the task; a tick at which it was due, and how many
# times from then on it did not begin; then the tick at which it began late, or -1.
TIMES = RELEASES + RecordRing.size(ROOM, 4)
# Then a ring for each task. A record: a tick, lateness and execution time of its step (ns), overruns so far.
WIDTH = 4


class Notes:
    """The rings of a loop in ``words``; ``rooms`` has the records for which each task's ring has room."""

    def __init__(self, words: Any, rooms: Sequence[int]) -> None:
        self.words, self.rooms = words, tuple(rooms)

        def ring(start: int, room: int, width: int) -> RecordRing:
            return RecordRing(words[start : start + RecordRing.size(room, width)], room, width)

        self.left_out, self.groups = ring(LEFT_OUT, ROOM, 2), ring(GROUPS, ROOM, 2)
        self.releases = ring(RELEASES, ROOM, WIDTH)
        self.starts = times_starts(rooms)
        self.times = [ring(start, room, WIDTH) for start, room in zip(self.starts, rooms, strict=True)]

    @staticmethod
    def size(rooms: Sequence[int]) -> int:
        """Return the number of words."""
        return TIMES + sum(RecordRing.size(room, WIDTH) for room in rooms)


def times_starts(rooms: Sequence[int]) -> list[int]:
    """Return where the ring of each task's times begins."""
    sizes = [RecordRing.size(room, WIDTH) for room in rooms]
    return [TIMES + sum(sizes[:number]) for number in range(len(rooms))]


def put_left_out(notes: Any, first: int, count: int) -> None:
    """Note that ticks are left out."""
    _put_pair(notes, LEFT_OUT, first, count)


def put_group(notes: Any, number: int, tick: int) -> None:
    """Note that a group of parameters holds from a tick on."""
    _put_pair(notes, GROUPS, number, tick)


def put_release(notes: Any, task: int, tick: int, count: int, late: int) -> None:
    """Note what a dispatched task missed; see `RELEASES`."""
    _put(notes, RELEASES, ROOM, task, tick, count, late)


def put_times(notes: Any, start: int, room: int, tick: int, late: int, taken: int, overruns: int) -> None:
    """Note the times of a task's step in the ring that begins at ``start``."""
    _put(notes, start, room, tick, late, taken, overruns)


def _put_pair(notes: Any, start: int, one: int, two: int) -> None:
    at = place_in(notes, start, ROOM, 2)
    if at >= 0:
        notes[at], notes[at + 1] = one, two
        _count(notes, start)


def _put(notes: Any, start: int, room: int, one: int, two: int, three: int, four: int) -> None:
    at = place_in(notes, start, room, WIDTH)
    if at >= 0:
        notes[at], notes[at + 1], notes[at + 2], notes[at + 3] = one, two, three, four
        _count(notes, start)


def _count(notes: Any, start: int) -> None:
    notes[start + PUT] += 1
