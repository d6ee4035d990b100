"""A capture: a process of its own reads a device whose calls may block, and leaves the newest record here.

 reader: Capture <--shared words-- worker: the calls that may block
             |                       ^
             +---starts--> keeper ---+ begins it anew when a call hangs or it has ended

The reader never waits after the start. When it ends, however it does, keeper and worker end too.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple

from quadvis.machine.mailbox import LAST, Mailbox
from quadvis.machine.processes import launching
from quadvis.machine.serial_port import PortError

STATUS, DEADLINE, TAKEN, REFUSED, HOPELESS, RESTARTS = range(6)  # words before the mailboxes
HEAD = 8
TEXT = 600  # bytes of what a worker says
TEXTS, RECORDS = 2, 3  # places
NUMBER = 8  # bytes of the number before a record
START = 6.0  # s that a device has until its first record
LOOK = 0.01  # s between two looks while the start waits
END = 1.0  # s that the keeper has to end

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


class Capture:
    """A capture as its reader has it, from `start` to `close`."""

    def __init__(self, context: SpawnContext, request: CaptureRequest) -> None:
        from quadvis.machine.keeper import keep

        words = context.RawArray("q", Post.size(request.room))
        self._post = Post(words, request.room)
        self._post.words[STATUS] = OPENING
        self.process: BaseProcess = context.Process(
            target=keep, args=(request, words), name="capture", daemon=True
        )

    def start(self) -> None:
        """Begin to capture."""
        with launching():
            self.process.start()

    def wait(self, seconds: float = START) -> None:
        """Wait for the first record; PortError, in a sentence, if none comes."""
        until = time.monotonic() + seconds
        while self._post.newest() is None:
            if self._post.words[HOPELESS]:
                raise PortError(self.text)
            if not self.process.is_alive():
                raise PortError("the process that captures has ended")
            if time.monotonic() > until:
                raise PortError(f"nothing has come for {seconds:g} s: {self.text or 'it does not answer'}")
            time.sleep(LOOK)

    def newest(self, before: int = LAST, after: int = -1) -> CapturedRecord | None:
        """Return the newest record with ``after`` < instant < ``before`` (ns); None if there is none."""
        return self._post.newest(before, after)

    @property
    def status(self) -> int:
        """How things stand."""
        return int(self._post.words[STATUS]) if self.process.exitcode is None else ENDED

    @property
    def text(self) -> str:
        """What the worker said last."""
        return self._post.text

    @property
    def refused(self) -> int:
        """How many records nobody may see."""
        return int(self._post.words[REFUSED])

    @property
    def restarts(self) -> int:
        """How often the worker was begun anew."""
        return int(self._post.words[RESTARTS])

    def close(self) -> None:
        """End the processes."""
        with suppress(AttributeError, ValueError):  # it was never started
            self.process.terminate()
            self.process.join(END)
            self.process.kill()
            self.process.join()
