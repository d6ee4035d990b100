"""The words by which loop, supervisor and guardian know of each other, and the whole of their shared memory.

Each word has one writer. A word is 8 bytes and is read and written whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from quadvis.realtime import lifeline, times
from quadvis.realtime.box import ParameterBox
from quadvis.realtime.notes import Notes
from quadvis.realtime.ring import RecordRing

START = 0  # by the loop: the instant of the start on the monotonic clock (ns); 0 before
TICK = 1  # by the loop: the tick whose step began last
BEGUN = (
    2  # by the loop: when the step began that is running (ns since the start, at least 1); 0 between steps
)
DONE = 3  # by the loop: grows with each step, and after the last one while the loop waits for others
END = 4  # by either: not 0 if the run is to end before its next step
LEFT = 5  # by the loop: not 0 once it runs no more steps, and no other loop does at the stop time
SAFE = 6  # by the loop: not 0 once the outputs are to hold their safe values to the end
RESTING = 7  # by the loop: when it began to wait for tasks that run by themselves, as BEGUN; 0 else
LIFELINE = slice(8, 8 + lifeline.SIZE)  # of the loop's thread
TICKS = LIFELINE.stop  # by the supervisor, before the start: at how many ticks the run ends
SHIFT = TICKS + 1  # by the supervisor: how much (ns) later than after its start each tick is due
MEASUREMENT = SHIFT + 1  # by the supervisor: the number of the measurement of blocks' times, see `profiles`
WORDS = MEASUREMENT + 1


class SharedMemory:
    """The words of a run: of control, of the tasks' times, of the rings, of the notes, of the parameter box.

    ``rooms`` has for how many steps of each task the notes have room, ``box`` how many words a group of
    parameters may have.
    """

    def __init__(
        self, words: Any, rooms: Sequence[int], rings: Sequence[tuple[int, int]], box: int = 0
    ) -> None:
        """Divide the ``words``; ``rings`` are the records that each has room for, and their widths."""
        view, tasks = memoryview(words).cast("B").cast("q"), len(rooms)
        self.control = view[:WORDS]
        ends = [WORDS + times.WORDS * (task + 1) for task in range(tasks)]
        self.times = view[WORDS : WORDS + times.WORDS * tasks]
        self.tasks = [view[end - times.WORDS : end] for end in ends]
        self.rings = []
        start = WORDS + times.WORDS * tasks
        for room, width in rings:
            size = RecordRing.size(room, width)
            self.rings.append(RecordRing(view[start : start + size], room, width))
            start += size
        end = start + Notes.size(rooms)
        self.notes = Notes(view[start:end], rooms)
        self.box = ParameterBox(view[end : end + ParameterBox.size(box)], box)

    @staticmethod
    def size(rooms: Sequence[int], rings: Sequence[tuple[int, int]], box: int = 0) -> int:
        """Return the number of words."""
        all_rings = sum(RecordRing.size(*ring) for ring in rings)
        return WORDS + times.WORDS * len(rooms) + all_rings + Notes.size(rooms) + ParameterBox.size(box)
