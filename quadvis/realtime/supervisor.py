"""The supervisor: it starts the applications of a real-time run, takes their rows, and sees to their end."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import wait
from typing import TYPE_CHECKING

from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.interrupts import held_back
from quadvis.machine.processes import launching
from quadvis.native.choice import Announce
from quadvis.realtime.application import GRACE
from quadvis.realtime.cables import Cables
from quadvis.realtime.devices import Devices
from quadvis.realtime.flight import Flight
from quadvis.realtime.guardian import Standing
from quadvis.realtime.lines import Lines
from quadvis.realtime.member import LeftOut, Member
from quadvis.realtime.options import RealTime

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

LEAD = 20_000_000  # ns from the moment when all are ready to the start
LOOK = 0.02  # s between two looks at the rings
HANG = 5.0  # s after which a step that has not ended is ended

UNSAFE = "its outputs may not be at their safe values"


def supervise(
    diagram: Diagram,
    wishes: RealTime,
    engine: str,
    taps: Sequence[Tap],
    left_out: LeftOut,
    tend: Callable[[float, float], None],
    announce: Announce | None = None,
) -> Flight:
    """Run a diagram in real time to its stop time, each computer in a process of its own.

    ``wishes`` have been checked. ``taps`` take rows here, ``left_out`` the ticks that a computer has left
    out, before the rows of later ticks. ``tend`` is called again and again while it runs, with the time of
    the last tick and the time since the start (s). RunError if a block fails, if the tasks have too many
    overruns, if a step does not end, or if a process is killed. However this ends, all processes have ended
    then, and all rows have been handed on.
    """
    supervisor = _Supervisor(diagram, wishes, engine, taps, left_out, announce or _nothing)
    try:
        return supervisor.follow(tend)
    except BaseException as error:
        for note in supervisor.end():
            error.add_note(note)
        raise


class _Supervisor:
    def __init__(
        self,
        diagram: Diagram,
        wishes: RealTime,
        engine: str,
        taps: Sequence[Tap],
        left_out: LeftOut,
        announce: Announce,
    ) -> None:
        context = multiprocessing.get_context("spawn")
        self._announce = announce
        asked = {name: wishes.on(diagram.computer(name)) for name in diagram.graph.computers}
        priority = max(each.priority or 0 for each in asked.values())
        standing = Standing.to(list(asked.values()))
        self._devices = Devices(context, diagram.graph, diagram.on_host_loss, standing)
        self._lines = Lines(context, diagram.links)
        self._cables = Cables(context, [*self._devices.cables, *self._lines.cables], priority)
        self._members = []
        for computer in diagram.graph.computers:
            part = diagram.graph.part_of(computer)
            own = [tap for tap in taps if tap.block in part]
            bindings = self._devices.bindings
            self._members.append(
                Member(
                    context,
                    diagram,
                    computer,
                    part,
                    asked[computer],
                    engine,
                    own,
                    left_out,
                    bindings,
                    announce,
                )
            )
        self._begun = False
        self._unsafe: list[str] = []  # what may be without its safe values, in sentences

    def follow(self, tend: Callable[[float, float], None]) -> Flight:
        """Start the applications and hand rows on until they have ended; an error if this is too early."""
        self._start()
        while any(member.process.is_alive() for member in self._members):
            sources = [source for member in self._alive for source in member.sources]
            wait([*sources, *self._devices.sources], LOOK)
            self._look()
            if alarm := self._devices.alarm():
                raise self._stopped(alarm.reason, alarm.block)
            if not self._begun and all(member.ready for member in self._members):
                self._begin()
            running = [member for member in self._members if member.running]
            if running:
                tend(min(member.time for member in running), running[0].now)
            for member in running:
                member.warn()
                self._check_step(member)
        self._look(last=True)
        if unsafe := self._close():
            raise RunError("; ".join(unsafe))
        first = self._members[0]
        tend(min(member.time for member in self._members), first.now)
        for member in self._members:
            member.warn(last=True)
        return Flight(
            tuple(member.share() for member in self._members), sum(member.lost for member in self._members)
        )

    def end(self) -> list[str]:
        """End all processes, orderly if possible; return what may be unsafe then, in sentences."""
        with held_back():
            self._devices.make_safe()
            for member in self._members:
                member.ask()
            for request in ("terminate", "terminate", "kill"):
                for member in self._alive:
                    getattr(member.process, request)()
                until = time.monotonic() + GRACE
                for member in self._alive:
                    member.process.join(max(0.0, until - time.monotonic()) if request != "kill" else None)
            for member in self._members:
                member.listen()
                member.take(last=True)
            self._unsafe += self._close()
        silent = [member for member in self._members if member.ended_silently]
        return [*self._unsafe, *([UNSAFE] if not all(member.is_guarded for member in silent) else [])]

    def _start(self) -> None:
        """Start all processes, those first on which others depend."""
        self._cables.start()
        self._lines.lay(self._cables.ends)
        guardian = self._start_devices()
        if guardian is not None:
            self._cables.watch(guardian)
        with launching():
            for place, member in enumerate(self._members):
                process = member.start(self._lines.of(member.computer))
                self._devices.watch(process, place)
                self._cables.watch(process)

    def _start_devices(self) -> int | None:
        """Let the outputs have their initial frames; RunError has a sentence for each port that is missing.

        So the outputs that are there are safe before anything else is found to be missing.
        """
        patiences = [member.patience for member in self._members]
        refusal = ""
        try:
            guardian = self._devices.start(self._cables.ends, patiences, self._announce)
        except RunError as error:
            guardian, refusal = None, str(error)
        missing = [*self._devices.missing(), *self._lines.missing()]
        if refusal and refusal not in missing:
            missing.insert(0, refusal)
        if missing:
            raise RunError("\n".join(missing))
        return guardian

    def _close(self) -> list[str]:
        """End what the applications needed; return a sentence for each port that may be unsafe."""
        unsafe = self._devices.close()
        self._cables.close()
        return unsafe

    def _stopped(self, reason: str, block: str = "") -> RunError:
        """End all applications; return the error of a run that must not go on.

        Its block is the one that is given, or that in which an application had to be interrupted.
        """
        moments = [member.moment for member in self._members if member.moment is not None]
        self.end()
        interrupted = [member.ending.block for member in self._members if member.ending]
        block = block or next(filter(None, interrupted), "")
        return RunError(reason, block=block, time=max(moments, default=None))

    @property
    def _alive(self) -> list[Member]:
        return [member for member in self._members if member.process.is_alive()]

    def _begin(self) -> None:
        """Let all applications run, from one instant on."""
        self._begun = True
        start = time.monotonic_ns() + LEAD
        for member in self._members:
            member.begin(start)

    def _look(self, *, last: bool = False) -> None:
        """Take what has come; an error if an application has ended early."""
        for member in self._members:
            ended = not member.process.is_alive()
            member.listen()
            member.take(last=last)
            if member.failed and (ended or member.ending):
                raise self._cause(member)

    def _cause(self, member: Member) -> QuadvisError:
        """Return why the run has ended early."""
        member.process.join(GRACE)
        return member.error()

    def _check_step(self, member: Member) -> None:
        """End a step that has lasted far too long."""
        longest = member.hangs(HANG)
        if not longest:
            return
        raise self._stopped(f"the step has not ended after {longest:g} s")


def _nothing(_: str) -> None:
    """Announce nothing."""
