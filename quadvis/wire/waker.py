"""A pipe by which other threads wake one that waits for sockets."""

from __future__ import annotations

import os
import threading
from contextlib import suppress


class Waker:
    """Registered with a poller by its descriptor; `wake` may be called from any thread, at any time."""

    def __init__(self) -> None:
        self._woken, self._waker = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self._lock = threading.Lock()
        self._closed = False

    def fileno(self) -> int:
        """Return the descriptor that can be read after `wake`."""
        return self._woken

    def wake(self) -> None:
        """Wake the thread that waits."""
        with self._lock, suppress(BlockingIOError):
            if not self._closed:
                os.write(self._waker, b"x")

    def drain(self) -> None:
        """Take back what `wake` has done."""
        with suppress(BlockingIOError):
            os.read(self._woken, 4096)

    def close(self) -> None:
        """Close the pipe."""
        with self._lock:
            self._closed = True
            os.close(self._woken)
            os.close(self._waker)
