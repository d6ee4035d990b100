"""The lives of other processes, each as a descriptor that becomes readable when the process has ended."""

from __future__ import annotations

import os
import select


class Lives:
    """Processes that are watched; a process that cannot be found has ended."""

    def __init__(self) -> None:
        self._watched: dict[int, int] = {}  # descriptors by process
        self._ended: set[int] = set()

    def watch(self, process: int) -> None:
        """Watch one more process."""
        try:
            self._watched[process] = os.pidfd_open(process)
        except ProcessLookupError:
            self._ended.add(process)

    @property
    def descriptors(self) -> list[int]:
        """The descriptors of those that live, for ``select``."""
        return list(self._watched.values())

    def look(self) -> None:
        """Note which ones have ended."""
        if not self._watched:
            return
        readable = select.select(self.descriptors, [], [], 0)[0]
        for process, descriptor in list(self._watched.items()):
            if descriptor in readable:
                os.close(self._watched.pop(process))
                self._ended.add(process)

    @property
    def any_ended(self) -> bool:
        """True if at least one has ended."""
        return bool(self._ended)

    @property
    def all_ended(self) -> bool:
        """True if none lives."""
        return not self._watched
