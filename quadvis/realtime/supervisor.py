"""The supervisor: it starts the application of a real-time run, takes its rows, and sees to its end."""

from __future__ import annotations

import multiprocessing
import signal
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING, Any

from quadvis.diagram.sections.overload import WARN
from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError, RunError, counted
from quadvis.errors.caller import IS_COMMAND
from quadvis.machine.interrupts import held_back
from quadvis.machine.processes import launching
from quadvis.native.choice import Choice
from quadvis.realtime import control, times
from quadvis.realtime.application import GRACE, Ending, Ready, Setup, perform
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.options import RealTime
from quadvis.realtime.ring import RecordRing
from quadvis.realtime.schedule import NANOSECONDS
from quadvis.realtime.streams import RowStream, streams_of
from quadvis.realtime.system import Grants
from quadvis.realtime.times import TaskTimes

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

LOOK = 0.02  # s between two looks at the rings
WARNED = 1.0  # s between two warnings
HANG = 5.0  # s after which a step that has not ended is ended

UNSAFE = "its outputs may not be at their safe values"

Announce = Callable[[str], None]


@dataclass(frozen=True)
class Flight:
    """A real-time run that has reached its stop time.

    ``lost`` is the number of rows that found no room on their way to the log and the verdicts.
    """

    engine: Choice
    grants: Grants
    tasks: tuple[TaskTimes, ...]
    lost: int

    @property
    def loss(self) -> str:
        """A sentence about the rows that were lost; "" if none were."""
        found = counted(self.lost, "row")
        return f"{found} found no room on the way to the log and the verdicts" if self.lost else ""

    def facts(self) -> dict[str, Any]:
        """Return it as plain data."""
        return {
            "granted": list(self.grants.granted),
            "not_granted": list(self.grants.refused),
            "tasks": {task.task: task.facts() for task in self.tasks},
            "lost_rows": self.lost,
        }


def supervise(
    diagram: Diagram,
    wishes: RealTime,
    engine: str,
    taps: Sequence[Tap],
    tend: Callable[[float, float], None],
    announce: Announce | None = None,
) -> Flight:
    """Run a diagram in real time to its stop time, in a process of its own; ``wishes`` have been checked.

    ``taps`` take rows here. ``tend`` is called again and again while it runs, with the time of the last tick
    and the time since the start (s). RunError if a block fails, if the tasks have too many overruns, if a
    step does not end, or if the process is killed. However this ends, the process has ended then, and all
    rows have been handed on.
    """
    supervisor = _Supervisor(diagram, wishes, engine, taps, announce or _nothing)
    try:
        return supervisor.follow(tend)
    except BaseException as error:
        if supervisor.end():
            error.add_note(UNSAFE)
        raise


class _Supervisor:
    def __init__(
        self, diagram: Diagram, wishes: RealTime, engine: str, taps: Sequence[Tap], announce: Announce
    ) -> None:
        self._diagram, self._announce = diagram, announce
        tasks = diagram.graph.tasks
        self._streams = streams_of(diagram.graph, taps)
        streams = tuple(stream for stream, _ in self._streams)
        rings = [stream.ring for stream in streams]
        context = multiprocessing.get_context("spawn")
        words = context.RawArray("q", SharedMemory.size(len(tasks), rings))
        self._shared = SharedMemory(words, len(tasks), rings)
        self._control = self._shared.control
        self._link, self._theirs = context.Pipe()
        setup = Setup(
            diagram.resolved, str(diagram.path.parent), diagram.path.name, diagram.own_blocks,
            IS_COMMAND.get(), engine, wishes, len(tasks), streams, words, self._theirs,
        )  # fmt: skip
        self._process: BaseProcess = context.Process(target=perform, args=(setup,), name="application")
        self._listening = True
        self._ready: Ready | None = None
        self._ending: Ending | None = None
        self._warned, self._overruns = 0.0, [0] * len(tasks)

    def follow(self, tend: Callable[[float, float], None]) -> Flight:
        """Start the application and hand rows on until it has ended; an error if this is too early."""
        with launching():
            self._process.start()
        self._theirs.close()
        while self._process.is_alive():
            wait([self._process.sentinel, *([self._link] if self._listening else [])], LOOK)
            self._listen()
            self._take()
            if self._control[control.START]:
                tend(self._time, self._now)
                self._warn()
                self._check_step()
        self._process.join()
        self._listen()
        self._take(last=True)
        if self._ending is None:
            raise self._killed()
        if self._ending.reason or self._ready is None:
            raise self._ending.error()
        tend(self._time, self._now)
        self._warn(last=True)
        tasks = zip(self._diagram.graph.tasks, self._shared.tasks, strict=True)
        found = tuple(TaskTimes.read(task.name, float(task.period), words) for task, words in tasks)
        lost = sum(len(stream.blocks) * ring.lost for (stream, _), ring in self._rings)
        return Flight(self._ready.engine, self._ready.grants, found, lost)

    def end(self) -> bool:
        """End the application, orderly if possible; return whether it had to be killed."""
        self._control[control.END] = 1
        requests = [self._process.terminate, self._process.terminate, self._process.kill]
        with held_back():
            while self._process.is_alive():
                requests.pop(0)()
                self._process.join(GRACE if requests else None)
            self._listen()
            self._take(last=True)
        return not requests

    @property
    def _rings(self) -> Iterable[tuple[tuple[RowStream, list[Tap]], RecordRing]]:
        return zip(self._streams, self._shared.rings, strict=True)

    @property
    def _time(self) -> float:
        """The time of the last tick (s)."""
        return float(self._control[control.TICK] * self._diagram.graph.tick)

    @property
    def _now(self) -> float:
        """The time since the start (s)."""
        return max(0, time.monotonic_ns() - self._control[control.START]) / NANOSECONDS

    def _take(self, *, last: bool = False) -> None:
        """Hand on the rows that have come."""
        for (stream, taps), ring in self._rings:
            stream.hand_on(ring.take(last=last), taps)

    def _listen(self) -> None:
        """Take what the application says before and after its run."""
        try:
            while self._listening and self._link.poll():
                said = self._link.recv()
                if isinstance(said, Ending):
                    self._ending = said
                elif isinstance(said, Ready):
                    self._ready = said
                    self._announce(f"real time: {said.grants}")
                else:
                    self._announce(said)
        except (EOFError, OSError):
            self._listening = False

    def _warn(self, *, last: bool = False) -> None:
        """Announce new overruns, at most once in a while and at the end."""
        found = [int(words[times.OVERRUNS]) for words in self._shared.tasks]
        if found == self._overruns or not (last or self._now >= self._warned + WARNED):
            return
        names = [task.name for task in self._diagram.graph.tasks]
        more = [
            f"task '{name}' has {counted(now - before, 'more overrun')}"
            for name, before, now in zip(names, self._overruns, found, strict=True)
            if now > before
        ]
        self._announce(f"t = {self._time:.9g} s: {', '.join(more)}")
        self._warned, self._overruns = self._now, found

    def _check_step(self) -> None:
        """End a step that has lasted far too long."""
        begun = self._control[control.BEGUN]
        limits = self._diagram.overload
        allowed = (limits.max + 1) * float(max(task.period for task in self._diagram.graph.tasks))
        if not begun or limits.action == WARN or self._now - begun / NANOSECONDS < max(HANG, allowed):
            return
        moment = self._time
        killed = self.end()
        block = self._ending.block if self._ending else ""
        error = RunError(f"the step has not ended after {max(HANG, allowed):g} s", block=block, time=moment)
        if killed:
            error.add_note(UNSAFE)
        raise error

    def _killed(self) -> QuadvisError:
        """Return the error of an application that has ended without a word."""
        code = self._process.exitcode or 0
        what = (
            f"was killed by {signal.Signals(-code).name}" if code < 0 else f"has ended with exit code {code}"
        )
        moment = self._time if self._control[control.START] else None
        error = RunError(f"the application {what}", time=moment)
        error.add_note(UNSAFE)
        return error


def _nothing(_: str) -> None:
    """Announce nothing."""
