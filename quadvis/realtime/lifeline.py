"""A lifeline: a lock in shared memory that the thread of a loop holds for as long as it lives.

Linux lets go of it in the moment in which the thread is killed. The end of a process is seen later, when its
memory has been given back: some 50 ms if 200 MB of it were locked.
"""

from __future__ import annotations

import ctypes
from typing import Any

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
        """Hold it until this thread ends."""
        self._library.pthread_mutex_lock(self._mutex)

    def wait(self) -> None:
        """Wait, without Python's lock, until nobody holds it."""
        self._library.pthread_mutex_lock(self._mutex)
