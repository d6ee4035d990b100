"""A lifeline: a lock in shared memory that a thread holds for as long as it lives.

Linux lets go of it in the moment in which the thread is killed. The end of a process is seen later, when its
memory has been given back: some 50 ms if 200 MB of it were locked.
"""

from __future__ import annotations

import ctypes
import errno
import os
import threading
from contextlib import suppress
from typing import Any

from quadvis.realtime.system import raise_thread

ROBUST = PROCESS_SHARED = 1
SIZE = 8  # words, at least those of a pthread_mutex_t


class Lifeline:
    """A robust mutex of the C library, in ``SIZE`` words that processes share."""

    def __init__(self, words: Any) -> None:
        first = ctypes.c_char.from_buffer(memoryview(words).cast("B"))
        self._mutex = ctypes.c_void_p(ctypes.addressof(first))
        self._first = first  # keeps the words alive
        self._library = ctypes.CDLL(None)

    def make(self) -> None:
        """Prepare the words, before any process holds them."""
        kind = ctypes.create_string_buffer(SIZE)
        self._library.pthread_mutexattr_init(kind)
        self._library.pthread_mutexattr_setrobust(kind, ROBUST)
        self._library.pthread_mutexattr_setpshared(kind, PROCESS_SHARED)
        self._library.pthread_mutex_init(self._mutex, kind)

    def hold(self) -> None:
        """Hold it until this thread ends or releases it."""
        self._library.pthread_mutex_lock(self._mutex)

    def release(self) -> None:
        """Let go of it, in the thread that holds it, if any does: the words may be freed then."""
        self._library.pthread_mutex_unlock(self._mutex)

    def wait(self) -> bool:
        """Wait, without Python's lock, until nobody holds it; return whether the holder has ended."""
        return bool(self._library.pthread_mutex_lock(self._mutex) == errno.EOWNERDEAD)


class Vigil:
    """Waits in a thread of its own for the end of the thread that holds a lifeline.

    ``words`` are those of the lifeline, ``priority`` is that of the thread that waits (0: none).
    """

    def __init__(self, words: Any, priority: int = 0) -> None:
        self._cut = os.eventfd(0, os.EFD_CLOEXEC | os.EFD_NONBLOCK)
        self._seen = False
        threading.Thread(target=self._wait, args=(Lifeline(words), priority), daemon=True).start()

    def _wait(self, line: Lifeline, priority: int) -> None:
        if priority:
            raise_thread(priority)
        if line.wait():
            os.eventfd_write(self._cut, 1)

    def has_ended(self) -> bool:
        """Whether the thread has ended."""
        if not self._seen:
            with suppress(BlockingIOError):
                os.eventfd_read(self._cut)
                self._seen = True
        return self._seen

    @property
    def descriptors(self) -> list[int]:
        """What becomes readable at the end, for ``select``; none once `has_ended` has reported it.

        An end between the two thus wakes ``select`` at once.
        """
        return [] if self._seen else [self._cut]
