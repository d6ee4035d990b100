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
from quadvis.realtime.helm import READY, Helm
from quadvis.realtime.options import RealTime
from quadvis.run.loops import Paced
from quadvis.run.result import Result
from quadvis.run.session import recorded


class Session:
    """One run. ``ready`` is done when it can begin, ``over`` when all has ended.

    ``result`` is there if it has come to an end in order, ``problem`` says why if not. ``announce`` takes
    sentences, ``settle`` the first tick of which rows may still come, and ``ended`` is called when all is
    over; all in the session's thread.
    """

    def __init__(
        self,
        diagram: Diagram,
        engine: str,
        log: Path,
        taps: Sequence[Tap],
        stop_time: float | None,
        announce: Callable[[str], None],
        settle: Callable[[int], None],
        ended: Callable[[], None],
    ) -> None:
        self.diagram, self.log = diagram, log
        self.helm = Helm(stop_time, self)
        self.ready: Future[None] = Future()
        self.over: Future[None] = Future()
        self.result: Result | None = None
        self.problem = ""
        self._engine, self._taps = engine, taps
        self._announce, self._settle, self._ended = announce, settle, ended
        self._thread = threading.Thread(target=self._perform, name="session", daemon=True)
        self._thread.start()

    def entered(self, state: str) -> None:
        """Hear of the run's state."""
        if state == READY:
            self.ready.set_result(None)

    def settled(self, tick: int) -> None:
        """Hear how far the rows are."""
        self._settle(tick)

    @property
    def stopped(self) -> bool:
        """True if it was told to end before its stop time."""
        return self.helm.is_stopped

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
            self.result = recorded(self.diagram, loop, log=self.log, keep=(), taps=self._taps)
        except QuadvisError as error:
            self.problem = "; ".join([str(error), *getattr(error, "__notes__", ())])
        except Exception as error:
            self.problem = surroundings(error) or traceback.format_exc()
        finally:
            if not self.ready.done():
                self.ready.set_exception(QuadvisError(self.problem or "it was stopped before it was ready"))
            self._ended()
            self.over.set_result(None)
