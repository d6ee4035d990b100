"""The words by which loop, supervisor and guardian know of each other, and the whole of their shared memory.

Each word has one writer. A word is 8 bytes and is read and written whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from quadvis.realtime import box, lifeline, times
from quadvis.realtime.box import ParameterBox
from quadvis.realtime.ring import RecordRing

START = 0  # by the loop: the instant of the start on the monotonic clock (ns); 0 before
TICK = 1  # by the loop: the tick whose step began last
BEGUN = (
    2  # by the loop: when the step began that is running (ns since the start, at least 1); 0 between steps
)
DONE = 3  # by the loop: the number of steps
END = 4  # by either: not 0 if the run is to end before its next step
LEFT = 5  # by the loop: not 0 once it runs no more steps
EARLY, AT_STOP_TIME = 1, 2  # what LEFT says
SAFE = 6  # by the loop: not 0 once the outputs are to hold their safe values to the end
LIFELINE = slice(8, 8 + lifeline.SIZE)  # of the loop's thread
TICKS = LIFELINE.stop  # by the supervisor, before the start: at how many ticks the run ends
LAST = TICKS + 1  # likewise: the last tick with a due task, if it is another one than the diagram has; or 0
WORDS = LAST + 1
LEFT_OUT = (
    4096,
    2,
)  # the ring of the ticks that the loop leaves out: its room, and its records, first and count
OWN_RINGS = LEFT_OUT, box.NOTED


class SharedMemory:
    """The words of a real-time run: of control, of the tasks' times, of the rings, of the parameter box.

    ``left_out`` is the ring of the ticks that the loop leaves out, ``noted`` that of the groups of parameters
    that it has taken from the ``box``.
    """

    def __init__(self, words: Any, tasks: int, rings: Sequence[tuple[int, int]], room: int = 0) -> None:
        """Divide the ``words``; ``rings`` are the records that each has room for, and their widths.

        ``room`` is that of the box.
        """
        view = memoryview(words).cast("B").cast("q")
        self.control = view[:WORDS]
        ends = [WORDS + times.WORDS * (task + 1) for task in range(tasks)]
        self.times = view[WORDS : WORDS + times.WORDS * tasks]
        self.tasks = [view[end - times.WORDS : end] for end in ends]
        made = []
        start = WORDS + times.WORDS * tasks
        for records, width in (*rings, *OWN_RINGS):
            size = RecordRing.size(records, width)
            made.append(RecordRing(view[start : start + size], records, width))
            start += size
        *self.rings, self.left_out, self.noted = made
        self.box = ParameterBox(view[start : start + ParameterBox.size(room)], room)

    @staticmethod
    def size(tasks: int, rings: Sequence[tuple[int, int]], room: int = 0) -> int:
        """Return the number of words."""
        sizes = sum(RecordRing.size(*ring) for ring in (*rings, *OWN_RINGS))
        return WORDS + times.WORDS * tasks + sizes + ParameterBox.size(room)
