"""A card that a process of its own reads, since the calls of its driver may block."""

from __future__ import annotations

import multiprocessing
import time
from dataclasses import dataclass

from quadvis.machine.capture import ENDED, OPENING, UNLIKE, CaptureRequest
from quadvis.machine.capture_process import CaptureProcess
from quadvis.machine.ports import Card, OpenPort, PortError, Waiting

NANOSECONDS = 10**9


@dataclass(frozen=True)
class CapturedCard(Card):
    """Settings of a card that is read as ``request`` says; each record is a piece."""

    request: CaptureRequest

    def open(self, port: str) -> OpenPort:
        """Begin to read, and wait for the first record; PortError, in a sentence, if none comes."""
        capture = CaptureProcess(multiprocessing.get_context("spawn"), self.request)
        try:
            capture.start()
            capture.wait()
        except BaseException:
            capture.close()
            raise
        return CapturePort(capture)


class CapturePort(OpenPort):
    """A capture as an open port, of which the newest record counts.

    A card that is lost gives no records until it is back; it is an error if it is not there at the end.
    """

    def __init__(self, capture: CaptureProcess) -> None:
        self._capture = capture
        self._instant = self._number = -1

    def read_waiting(self) -> Waiting:
        """Return the newest record, if it is new; PortError if none can come any more."""
        if self._capture.status in (UNLIKE, ENDED):
            raise PortError(self._capture.text or "the process that reads has ended")
        found = self._capture.newest(after=self._instant)
        if found is None:
            return Waiting()
        skipped = found.number - self._number - 1 if self._number > 0 else 0
        self._instant, self._number = found.instant, found.number
        age = (time.monotonic_ns() - found.instant) / NANOSECONDS
        return Waiting((bytes(found.payload),), skipped=max(0, skipped), age=age)

    def close(self) -> None:
        """End the process; PortError if the card is lost."""
        status, text = self._capture.status, self._capture.text
        self._capture.close()
        if status == OPENING:
            raise PortError(text)
