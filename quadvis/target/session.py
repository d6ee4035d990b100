"""A session: one run of an application, from its processes' start to their end, in a thread of its own."""

from __future__ import annotations

import threading
import traceback
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from pathlib import Path

from quadvis.diagram.diagram import Diagram
from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError
from quadvis.machine.failures import surroundings
from quadvis.realtime.helm import Helm
from quadvis.realtime.options import RealTime
from quadvis.run.loops import Paced
from quadvis.run.result import Result
from quadvis.run.session import recorded


class Session:
    """One run. ``ready`` is done when the processes can begin, ``over`` when all has ended. ``result`` is there if it has come to an end in order, ``problem`` says why if not.

    ``announce`` takes sentences, ``ended`` is called when all is over; both in the session's thread.
    """

    def __init__(
        self,
        diagram: Diagram,
        engine: str,
        log: Path,
        taps: Sequence[Tap],
        announce: Callable[[str], None],
        ended: Callable[[], None],
        settle: Callable[[int], None],
    ) -> None:
        self.diagram, self.log, self.helm = diagram, log, Helm()
        self.ready: Future[None] = Future()
        self.over: Future[None] = Future()
        self.helm.on_state = self._changed
        self.helm.settle = settle
        self.result: Result | None = None
        self.problem = ""
        self._engine, self._taps = engine, taps
        self._announce, self._ended = announce, ended
        self._thread = threading.Thread(target=self._perform, name="session", daemon=True)
        self._thread.start()

    @property
    def stopped(self) -> bool:
        """True if it was told to end before its stop time."""
        return self.helm.stopped

    @property
    def running(self) -> bool:
        """True until all is over."""
        return self._thread.is_alive()

    def join(self, timeout: float | None = None) -> None:
        """Wait for the end."""
        self._thread.join(timeout)

    def _perform(self) -> None:
        try:
            loop = Paced(self.diagram, self._engine, self._announce, RealTime(), self.helm)
            self.result = recorded(
                self.diagram, loop, log=self.log, keep=(), taps=self._taps
            )
        except QuadvisError as error:
            self.problem = "; ".join([str(error), *getattr(error, "__notes__", ())])
        except Exception as error:
            self.problem = surroundings(error) or traceback.format_exc()
        finally:
            if not self.ready.done():
                self.ready.set_exception(QuadvisError(self.problem or "it was stopped before it was ready"))
            self._ended()
            self.over.set_result(None)

    def _changed(self) -> None:
        if self.helm.state == "ready" and not self.ready.done():
            self.ready.set_result(None)
