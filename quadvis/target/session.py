"""A session: one run of an application, from its processes' start to their end, in a thread of its own."""

from __future__ import annotations

import math
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import suppress
from pathlib import Path

from quadvis.diagram.diagram import Diagram
from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError
from quadvis.machine.failures import surroundings
from quadvis.output.recording import RecordedBlock
from quadvis.output.stretch import NANOSECONDS
from quadvis.output.wrapped_log import WrappedLog
from quadvis.realtime.helm import READY, Helm
from quadvis.realtime.options import RealTime
from quadvis.run.loops import Paced
from quadvis.run.result import Result
from quadvis.run.session import recorded
from quadvis.target.profiler import Profiler


class Session:
    """One run. ``ready`` is done when it can begin, ``over`` when all has ended.

    ``samples`` is how many of the fastest task the log is to have, infinite for all; ``wraps`` counts how
    often it has begun anew. The log of a run that never began is removed. ``profiler`` gets the times of
    tasks, and asks for those of blocks.

    ``result`` is there if it has come to an end in order, ``problem`` says why if not. ``announce`` takes
    sentences, ``settle`` the first tick of which rows may still come, and ``ended`` is called when all is
    over; all in the session's thread.
    """

    def __init__(
        self,
        diagram: Diagram,
        engine: str,
        log: Path,
        samples: float,
        profiler: Profiler,
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
        self._engine, self._taps, self._samples = engine, taps, samples
        self._wrapped: WrappedLog | None = None
        self._profiler = profiler
        profiler.follow(self.helm)
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
        """True until all is over; whoever was waiting for that may begin another one."""
        return not self.over.done()

    @property
    def wraps(self) -> int:
        """How often the log has begun anew, since it was full."""
        return self._wrapped.wraps if self._wrapped is not None else 0

    def join(self, timeout: float | None = None) -> None:
        """Wait for the end."""
        self._thread.join(timeout)

    def _perform(self) -> None:
        try:
            loop = Paced(self.diagram, self._engine, self._announce, RealTime(), self.helm)
            opened = self._open if math.isfinite(self._samples) else None
            self.result = recorded(
                self.diagram,
                loop,
                log=self.log,
                keep=(),
                taps=self._taps,
                open_log=opened,
                timed=self._profiler.take,
            )
            self.problem = "; ".join(self.result.flight.problems if self.result.flight else ())
        except QuadvisError as error:
            self.problem = "; ".join([str(error), *getattr(error, "__notes__", ())])
        except Exception as error:
            self.problem = surroundings(error) or traceback.format_exc()
        finally:
            if not self.helm.is_begun:
                with suppress(OSError):
                    self.log.unlink(missing_ok=True)
            if not self.ready.done():
                self.ready.set_exception(QuadvisError(self.problem or "it was stopped before it was ready"))
            try:
                self._ended()
            finally:
                self.over.set_result(None)  # whatever failed: else nothing could be started any more

    def _open(
        self, path: str | Path, blocks: Sequence[RecordedBlock], facts: Mapping[str, str]
    ) -> WrappedLog:
        span = int(self._samples * self.diagram.graph.tick * NANOSECONDS)
        self._wrapped = WrappedLog(path, blocks, facts, span)
        return self._wrapped
