"""The helm: how another thread of the supervisor's process steers a real-time run."""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from typing import Any

from quadvis.realtime.times import TaskTimes


class Helm:
    """interim"""

    def __init__(self) -> None:
        self.state = "starting"
        self.tick, self.time = 0, 0.0
        self.wanted_begin = self.wanted_stop = False
        self._wake_r, self._wake_w = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
        self.on_state: Any = lambda: None
        self.members: Any = []
        self.stopped = False

    def begin(self) -> None:
        self.wanted_begin = True
        os.write(self._wake_w, b"x")

    def stop(self) -> None:
        self.wanted_stop = True
        os.write(self._wake_w, b"x")

    def make_safe(self, reason: str) -> None:
        self.stop()

    def tune(self, changes: Sequence[Any]) -> Future[int]:
        f: Future[int] = Future()
        f.set_result(self.tick)
        return f

    def times(self) -> Mapping[str, tuple[TaskTimes, ...]]:
        return {m.computer: m.times() for m in self.members}
