"""The parameter box: the words through which a group of new values reaches the memory of a running loop.

The supervisor puts one group and waits until the loop has noted its tick; only then it puts the next one. So
there is one writer at a time on either side, and the loop compares one word before each tick. The loop takes
the group whole, at the first tick from a given one on at which no task of the group is running.

The loop's side is in `pacing`. The number of a group is written last. A processor such as ARM may
show it before the words of the group; a check over them says so, and the loop looks again at its next tick.
Its answer is one word, so it is there whole or not at all, and the supervisor need not look twice.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

# Words of the head: the number of the group; the tick before which it must not hold; the tasks with blocks of
# the group, as bits; how many words follow the head; a check over all of them; how many have room; and by the
# loop: the tick from which a group holds, times `ANSWERS`, and the last digit of its number to this base.
NUMBER, NOT_BEFORE, TASKS, LENGTH, CHECK, ROOM, ANSWER = range(7)
HEAD = 8
# Behind the head, for each parameter: its first slot in memory, the number of slots, their contents.
ENTRY = 2
LOW = (1 << 48) - 1  # bits of a check that are multiplied: their product fits a word
ANSWERS = 256  # groups in a row whose answers differ; a tick is below 2**53, so their product fits a word


class ParameterBox:
    """The box as the supervisor has it, with ``room`` words for a group."""

    def __init__(self, words: Any, room: int) -> None:
        self.words = words
        words[ROOM] = room

    @staticmethod
    def size(room: int) -> int:
        """Return the number of words of a box."""
        return HEAD + room

    def put(self, entries: Iterable[tuple[int, Sequence[int]]], tasks: int, not_before: int = 0) -> int:
        """Put a group: the first slot and the new words of each parameter; return the group's number.

        ``tasks`` are those of its blocks, as bits. The loop must have taken the group before.
        """
        words, at = self.words, HEAD
        for slot, contents in entries:
            words[at], words[at + 1] = slot, len(contents)
            at += ENTRY
            for content in contents:
                words[at] = content
                at += 1
        words[NOT_BEFORE], words[TASKS], words[LENGTH] = not_before, tasks, at - HEAD
        number = int(words[NUMBER]) + 1
        words[CHECK] = check(words, number)
        words[NUMBER] = number
        return number

    def taken(self, number: int) -> int | None:
        """Return the tick from which the newest group, of this number, holds; None if it is not taken yet."""
        tick, digit = divmod(int(self.words[ANSWER]), ANSWERS)
        return tick if digit == number % ANSWERS else None


def check(box: Any, number: int) -> int:
    """Return the check of the group in a box that has a number."""
    found: int = number ^ box[NOT_BEFORE] ^ (box[TASKS] << 1)
    for at in range(HEAD, HEAD + box[LENGTH]):
        found = ((found & LOW) * 31) ^ box[at]
    return found
