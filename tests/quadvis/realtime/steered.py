"""A real-time run in a thread, which a test steers."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path

import quadvis
from quadvis.api import Diagram
from quadvis.realtime.helm import Helm
from quadvis.run.loops import Paced
from quadvis.run.result import Result
from quadvis.run.session import recorded
from tests.processes import wait_for

CALM = quadvis.RealTime(priority=0, poll="0 s")


class Steered:
    """A run in a thread, with the helm in this one."""

    def __init__(self, diagram: Diagram, engine: str = "python", log: Path | None = None) -> None:
        self.helm = Helm()
        self.error: BaseException | None = None
        self.result: Result | None = None
        self._loop = Paced(diagram, engine, None, CALM, self.helm)
        self._diagram, self._log = diagram, log
        self._thread = threading.Thread(target=self._run)

    def _run(self) -> None:
        try:
            self.result = recorded(self._diagram, self._loop, log=self._log, keep=("*",))
        except BaseException as error:
            self.error = error

    def __enter__(self) -> Steered:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.helm.stop()
        self._thread.join()

    def until(self, condition: Callable[[], bool]) -> None:
        """Wait; the error of the run if it fails meanwhile."""
        wait_for(lambda: self.error is not None or condition())
        if self.error is not None:
            raise self.error

    def reach(self, state: str) -> None:
        self.until(lambda: self.helm.state == state)

    def end(self) -> Result:
        self._thread.join()
        if self.error is not None:
            raise self.error
        assert self.result is not None
        return self.result
