"""The captures of an application: processes that read the devices whose calls may block."""

from __future__ import annotations

import multiprocessing
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Protocol

from quadvis.block import CapturedInput, SourceRecord
from quadvis.engine.engine import Engine
from quadvis.errors import RunError
from quadvis.graph.devices import devices
from quadvis.machine.capture_process import CaptureProcess
from quadvis.machine.ports import PortError
from quadvis.realtime.schedule import NANOSECONDS


class Start(Protocol):
    """Whoever knows the start of the run."""

    start: int  # ns on the monotonic clock


class RunSource:
    """A capture as its block sees it: stamps are in run time."""

    def __init__(self, capture: CaptureProcess, clock: Start) -> None:
        self._capture, self._clock = capture, clock

    def newest(self, time: float, after: float) -> SourceRecord | None:
        """Return the newest record with ``after`` < stamp < ``time`` (s); None if there is none."""
        start = self._clock.start
        found = self._capture.newest(_instant(time, start), _instant(after, start))
        if found is None:
            return None
        return SourceRecord((found.instant - start) / NANOSECONDS, found.number, found.payload)

    @property
    def status(self) -> int:
        """How things stand."""
        return self._capture.status

    @property
    def refused(self) -> int:
        """How many records are not as they must be."""
        return self._capture.refused

    @property
    def text(self) -> str:
        """What is wrong, or what the device is."""
        return self._capture.text


class Captures:
    """The captures of an engine's blocks, until the end of the context."""

    def __init__(self, engine: Engine, clock: Start) -> None:
        context = multiprocessing.get_context("spawn")
        self._begun: dict[str, CaptureProcess] = {}
        for path, device in devices(engine.graph):
            if isinstance(device, CapturedInput):
                with _named(path):
                    self._begun[path] = CaptureProcess(context, device.capture())
                engine.bound(path).source = RunSource(self._begun[path], clock)

    def start(self) -> None:
        """Begin them all."""
        for capture in self._begun.values():
            capture.start()

    def wait(self) -> Iterator[str]:
        """Wait for the first record of each; yield what is to be known of it. RunError if none comes."""
        for path, capture in self._begun.items():
            with _named(path):
                capture.wait()
            yield f"block '{path}': {capture.text}"

    def __enter__(self) -> Captures:
        return self

    def __exit__(self, *_: object) -> None:
        for capture in self._begun.values():
            capture.close()


@contextmanager
def _named(path: str) -> Iterator[None]:
    """Let a fault of a port be one of a block."""
    try:
        yield
    except PortError as error:
        raise RunError(str(error), block=path) from None


def _instant(time: float, start: int) -> int:
    return start + round(time * NANOSECONDS)
