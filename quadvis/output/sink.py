"""A file that a thread of its own writes: whoever fills it does not wait for the disk, and outlives it."""

from __future__ import annotations

import os
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from time import monotonic
from typing import BinaryIO

from quadvis.machine.files import reason

ROOM = 8 << 20  # bytes that may wait for the disk
HUNG = 5.0  # s after which a disk that takes nothing at all is given up at the end


@dataclass(frozen=True)
class Batch:
    """Bytes that are written together, and what is in them: so many rows from a stamp (ns) on."""

    data: bytes
    rows: int = 0
    first: int = 0


class Sink:
    """Takes what a file is made of, as a binary stream; `hand_on` gives it to the thread as one batch.

    When the disk refuses, `failure` says why, and nothing is written any more: the file ends with the last
    whole batch. `lost` counts the rows that are not in it, from `lost_from` (ns) on.
    """

    def __init__(self, file: BinaryIO) -> None:
        """Write to a file that is open and empty, and close it in the end."""
        self.failure = ""
        self.lost = 0
        self.lost_from: int | None = None
        self._file = file
        self._parts: list[bytes] = []
        self._taken = 0
        self._queue: deque[Batch] = deque()
        self._waiting = self._written = self._whole = 0  # bytes; the last are those of whole batches
        self._ending = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._work, name="log", daemon=True)
        self._thread.start()

    def write(self, data: bytes) -> int:
        """Take bytes for the next batch."""
        self._parts.append(bytes(data))
        self._taken += len(data)
        return len(data)

    def tell(self) -> int:
        """Return how many bytes were taken in all."""
        return self._taken

    def flush(self) -> None:
        """Do nothing: batches are ended by `hand_on`."""

    def hand_on(self, rows: int = 0, first: int = 0) -> None:
        """Hand what was taken to the thread as one batch, in which there are so many rows from a stamp on."""
        batch = Batch(b"".join(self._parts), rows, first)
        self._parts.clear()
        with self._changed:
            if self.failure:
                self.lose(rows, first)
            elif batch.data:
                self._queue.append(batch)
                self._waiting += len(batch.data)
                self._changed.notify_all()

    def lose(self, rows: int, first: int) -> None:
        """Count rows that do not get into the file."""
        if rows:
            self.lost += rows
            self.lost_from = first if self.lost_from is None else min(first, self.lost_from)

    @property
    def full(self) -> bool:
        """Whether so much waits for the disk that nothing should be added, or nothing is written any more."""
        return self._waiting > ROOM or bool(self.failure)

    def wait_for_room(self, longest: float) -> float:
        """Wait until there is room, but no longer than so many seconds; return how long it took."""
        began = monotonic()
        with self._changed:
            self._changed.wait_for(lambda: self._waiting <= ROOM or bool(self.failure), longest)
        return monotonic() - began

    def drain(self) -> None:
        """Wait until all is with the operating system, or until the disk has taken nothing for `HUNG` s."""
        with self._changed:
            while self._waiting and not self.failure:
                before = self._written
                self._changed.wait(HUNG)
                if self._waiting and self._written == before:
                    self._give_up("the disk takes nothing any more")

    def close(self) -> None:
        """Write what waits, and close the file; a disk that hangs keeps it."""
        self.drain()
        with self._changed:
            self._ending = True
            self._changed.notify_all()
        self._thread.join(HUNG)

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._queue or self._ending)
                if not self._queue:
                    break
                batch = self._queue[0]
            try:
                self._put(batch.data)
            except OSError as error:
                # A part of a batch is of no use, and would make the count of what is lost wrong.
                with suppress(OSError):
                    os.ftruncate(self._file.fileno(), self._whole)
                with self._changed:
                    self._give_up(reason(error))
                break
            self._whole += len(batch.data)
            with self._changed:
                if self.failure:
                    break
                self._queue.popleft()
                self._waiting -= len(batch.data)
                self._changed.notify_all()
        with suppress(OSError):
            self._file.close()

    def _put(self, data: bytes) -> None:
        left = memoryview(data)
        while left:
            count = os.write(self._file.fileno(), left)
            left = left[count:]
            with self._changed:
                self._written += count
                self._changed.notify_all()

    def _give_up(self, why: str) -> None:
        """Write nothing any more; called with the lock held."""
        self.failure = self.failure or why
        while self._queue:
            batch = self._queue.popleft()
            self.lose(batch.rows, batch.first)
        self._waiting = 0
        self._changed.notify_all()
