"""The words of `dispatch` for a program: what is copied between its tasks, a mutex, a semaphore for each."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Any

import numpy as np

from quadvis.engine.layout import TIME
from quadvis.engine.program import Op, Program
from quadvis.realtime import dispatch
from quadvis.realtime.dispatch import COUNT, HEAD, ROW
from quadvis.realtime.words import whole_words

ROOM = 16  # words for a mutex or a semaphore: more than any Linux needs
INHERITED = 1  # PTHREAD_PRIO_INHERIT


def crew_words(program: Program) -> tuple[Any, list[Any]]:
    """Return the words, and what has to live as long as they do."""
    count = len(program.tasks)
    heads = HEAD + ROW * count + 2 * count * count
    found, copies = _copies(program, heads)
    words = whole_words(heads + len(copies))
    words[COUNT] = count
    for at, value in (*found.items(), *enumerate(copies, heads)):
        words[at] = value
    return words, _of_c(words)


def _copies(program: Program, start: int) -> tuple[dict[int, int], list[int]]:
    """Return the words that say where copies begin, and the copies, which begin at ``start``."""
    count = len(program.tasks)
    copies: list[int] = []

    def place(ops: Sequence[Op]) -> int:
        if not ops:
            return 0
        first = start + len(copies)
        copies.append(len(ops))
        for op in ops:
            copies.extend((op.sources[0].position, op.targets[0].position, op.sources[0].size))
        return first

    numbers = {task.name: number for number, task in enumerate(program.tasks)}
    givers = {slot: numbers[block.task] for block in program.blocks for slot in block.outputs.values()}
    found = {}
    for number, task in enumerate(program.tasks[1:], 1):
        found[HEAD + ROW * number + dispatch.DELAYS] = place(task.delays)
        # Time is the thread's own. The fastest task's loop swaps late values, so it gives them.
        latches = [op for op in task.latches if op.sources[0] != TIME]
        for giver in range(number):
            ops = [op for op in latches if givers.get(op.sources[0], 0) == giver]
            found[HEAD + ROW * count + (count + giver) * count + number] = place(ops)
    return found, copies


def _of_c(words: Any) -> list[Any]:
    """Put a mutex, semaphores and the functions for them into the words; return their memory."""
    library, kept = ctypes.CDLL(None), list[Any]()

    def room() -> int:
        kept.append(np.zeros(ROOM, np.int64))
        return int(kept[-1].ctypes.data)

    functions = (
        library.pthread_mutex_lock, library.pthread_mutex_unlock, library.sem_post, library.sem_wait,
    )  # fmt: skip
    for at, function in enumerate(functions, dispatch.LOCK):
        words[at] = ctypes.cast(function, ctypes.c_void_p).value or 0
    attributes, mutex = room(), room()
    words[dispatch.MUTEX] = mutex
    library.pthread_mutexattr_init(ctypes.c_void_p(attributes))
    library.pthread_mutexattr_setprotocol(ctypes.c_void_p(attributes), INHERITED)
    library.pthread_mutex_init(ctypes.c_void_p(mutex), ctypes.c_void_p(attributes))
    for number in range(words[COUNT]):
        semaphore = room()
        words[HEAD + ROW * number + dispatch.SEMAPHORE] = semaphore
        library.sem_init(ctypes.c_void_p(semaphore), 0, 0)
    return kept
