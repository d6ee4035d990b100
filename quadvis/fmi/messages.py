"""What an FMU says to its user while it runs: the last messages, within limits."""

from __future__ import annotations

import ctypes
from collections import deque
from typing import Any

KEPT = 5
LONGEST = 500  # characters of a message


class Messages:
    """The last messages of an instance that say that something is wrong, or any if there is none such."""

    def __init__(self) -> None:
        self._plain: deque[str] = deque(maxlen=1)
        self._grave: deque[str] = deque(maxlen=KEPT)
        self._library: Any = None

    def take(self, status: int, text: bytes | None) -> None:
        """Take a message."""
        words = " ".join((text or b"")[: 4 * LONGEST].decode("utf-8", "replace").split())[:LONGEST]
        if words:
            (self._grave if status else self._plain).append(words)

    def format_with(self, library: str, callbacks: Any) -> None:
        """Let a library put the values into the texts, which come as those of printf in FMI 2.0.

        Without it the texts come as they are.
        """
        try:
            self._library = ctypes.CDLL(library)
            self._library.addLoggerProxy.restype = None
            self._library.addLoggerProxy(callbacks)
        except (OSError, AttributeError):
            self._library = None

    def text(self) -> str:
        """Return the last messages as one text."""
        return "; ".join(dict.fromkeys(self._grave or self._plain))

    def clear(self) -> None:
        """Forget what was said."""
        self._grave.clear()
        self._plain.clear()
