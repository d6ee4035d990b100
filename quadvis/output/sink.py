"""A file that its own thread writes: the run that fills it never waits for the disk, and survives it."""

from __future__ import annotations

import os
import threading
from collections import deque
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from time import monotonic
from typing import BinaryIO

from quadvis.machine.files import reason

ROOM = 8 << 20  # bytes that may wait to be written
HUNG = 5.0  # s without any progress of the disk after which `drain` gives up


@dataclass(frozen=True)
class Batch:
    """Bytes that are written together, with the number of their rows and the stamp (ns) of the first."""

    data: bytes
    rows: int = 0
    first: int = 0


class Sink:
    """A binary stream that takes the contents of a file; `hand_on` gives them to the thread as one batch.

    When the disk refuses, `failure` says why, and writing ends: the file ends with the last whole batch.
    `lost` counts the rows that are missing from `lost_from` (ns) on.
    """

    def __init__(self, file: BinaryIO, synced: bool = False) -> None:
        """Write to an open, empty file, and close it at the end.

        A ``synced`` one has the disk itself take each batch, so that it survives the loss of power.
        """
        self.failure = ""
        self.lost = 0
        self.lost_from: int | None = None
        self._file = file
        self._synced = synced
        self._parts: list[bytes | memoryview] = []
        self._taken = 0
        self._queue: deque[Batch] = deque()
        self._waiting = self._written = self._whole = 0  # in bytes; `_whole` counts whole batches only
        self._ending = False
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._work, name="log", daemon=True)
        self._thread.start()

    def write(self, data: bytes | memoryview) -> int:
        """Take bytes for the next batch; they are copied by `hand_on`."""
        self._parts.append(data)
        self._taken += len(data)
        return len(data)

    def tell(self) -> int:
        """Return the number of bytes taken so far."""
        return self._taken

    def hand_on(self, rows: int = 0, first: int = 0) -> None:
        """Hand the bytes taken to the thread as one batch; `first` is the stamp (ns) of its first row."""
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
        """Count rows that are left out of the file."""
        if rows:
            self.lost += rows
            self.lost_from = first if self.lost_from is None else min(first, self.lost_from)

    @property
    def full(self) -> bool:
        """True if too many bytes wait for the disk, or if writing has ended."""
        return self._waiting > ROOM or bool(self.failure)

    def wait_for_room(self, longest: float) -> float:
        """Wait until there is room, at most `longest` (s); return the time that it took (s)."""
        began = monotonic()
        with self._changed:
            self._changed.wait_for(lambda: self._waiting <= ROOM or bool(self.failure), longest)
        return monotonic() - began

    def drain(self) -> None:
        """Wait until the operating system has all bytes, or until the disk has taken none for `HUNG` s."""
        with self._changed:
            while self._waiting and not self.failure:
                before = self._written
                if not self._changed.wait_for(partial(self._moved, before), HUNG):
                    self._give_up("the disk takes nothing any more")

    def _moved(self, before: int) -> bool:
        """Return whether the disk has taken more than so many bytes, or will take no more."""
        return self._written != before or not self._waiting or bool(self.failure)

    def close(self) -> None:
        """Write the waiting bytes and close the file; if the disk hangs, the file stays open."""
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
                if self._synced:
                    os.fsync(self._file.fileno())
            except OSError as error:
                # Part of a batch is useless, and would make the count of lost rows wrong.
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
        """End writing; called with the lock held."""
        self.failure = self.failure or why
        while self._queue:
            batch = self._queue.popleft()
            self.lose(batch.rows, batch.first)
        self._waiting = 0
        self._changed.notify_all()
