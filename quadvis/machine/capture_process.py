"""A capture: a process of its own reads a device whose calls may block, and leaves the newest record here.

 reader: CaptureProcess <--shared words-- worker: the calls that may block
             |                              ^
             +---starts--> keeper ----------+ begins it anew when a call hangs or it has ended

The reader never waits after the start. When it ends, however it does, keeper and worker end too.
"""

from __future__ import annotations

import time
from contextlib import suppress
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess

from quadvis.machine.capture import (
    ENDED,
    HOPELESS,
    OPENING,
    REFUSED,
    RESTARTS,
    STATUS,
    CapturedRecord,
    CaptureRequest,
    Post,
)
from quadvis.machine.keeper import keep
from quadvis.machine.mailbox import LAST
from quadvis.machine.ports import PortError
from quadvis.machine.processes import launching

START = 6.0  # s that a device has until its first record
LOOK = 0.01  # s between two looks while the start waits
END = 1.0  # s that the keeper has to end


class CaptureProcess:
    """A capture as its reader has it, from `start` to `close`."""

    def __init__(self, context: SpawnContext, request: CaptureRequest) -> None:
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
