"""What a capture shares: a request, and words in which a worker leaves the newest record of a device."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

from quadvis.machine.mailbox import LAST, Mailbox

STATUS, DEADLINE, TAKEN, REFUSED, HOPELESS, RESTARTS = range(6)  # words before the mailboxes
HEAD = 8
TEXT = 600  # bytes of what a worker says
TEXTS, RECORDS = 2, 3  # places
NUMBER = 8  # bytes of the number before a record

GOOD, OPENING, REFUSING, UNLIKE, ENDED = range(5)  # the status of a capture


@dataclass(frozen=True)
class CaptureRequest:
    """What is to be captured: ``function`` ("package.module:name") reads the device that ``about`` describes.

    ``about`` is plain data. A record has at most ``room`` bytes.
    """

    function: str
    about: Any
    room: int


class CapturedRecord(NamedTuple):
    """A record: its instant on the monotonic clock (ns), its number from 1, and its bytes."""

    instant: int
    number: int
    payload: memoryview


class Post:
    """The shared words as the worker has them: it says here what it does and leaves its records."""

    def __init__(self, words: Any, room: int) -> None:
        self.words = memoryview(words).cast("B").cast("q")
        texts = HEAD + Mailbox.size(TEXT, TEXTS)
        self._texts = Mailbox(self.words[HEAD:texts], TEXT, TEXTS)
        self._records = Mailbox(self.words[texts:], room + NUMBER, RECORDS)
        self.room = room

    @staticmethod
    def size(room: int) -> int:
        """Return the number of words."""
        return HEAD + Mailbox.size(TEXT, TEXTS) + Mailbox.size(room + NUMBER, RECORDS)

    def calling(self, seconds: float) -> None:
        """Announce a call that takes at most so long; if it takes longer, the worker is begun anew."""
        self.words[DEADLINE] = time.monotonic_ns() + round(seconds * 1e9)

    def say(self, status: int, text: str, *, hopeless: bool = False) -> None:
        """Say how things stand; ``hopeless`` if waiting will not help a start."""
        self._texts.put(text.encode()[:TEXT])
        self.words[STATUS] = status
        self.words[HOPELESS] = hopeless

    def take(self) -> int:
        """Count a record of the device, whatever becomes of it; return how many there were."""
        self.words[TAKEN] += 1
        return int(self.words[TAKEN])

    def refuse(self) -> None:
        """Count a record that nobody may see."""
        self.words[REFUSED] += 1

    def put(self, instant: int, number: int, pieces: Iterable[Any]) -> None:
        """Leave a record that is made of pieces."""
        payload = b"".join([number.to_bytes(NUMBER, "little"), *pieces])
        self._records.put(payload, instant)

    @property
    def text(self) -> str:
        """What was said last."""
        found = self._texts.newest()
        return found.payload.decode(errors="replace") if found is not None else ""

    def newest(self, before: int = LAST, after: int = -1) -> CapturedRecord | None:
        """Return the newest record with ``after`` < instant < ``before`` (ns); None if there is none."""
        found = self._records.newest(before, after)
        if found is None:
            return None
        payload = memoryview(found.payload)
        return CapturedRecord(found.stamp, int.from_bytes(payload[:NUMBER], "little"), payload[NUMBER:])
