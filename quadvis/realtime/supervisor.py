"""The supervisor: it starts the applications of a real-time run, takes their rows, and sees to their end."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Callable, Sequence
from multiprocessing.connection import wait
from typing import TYPE_CHECKING

from quadvis.engine.taps import Tap
from quadvis.engine.tuning import Change
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.interrupts import held_back, put_off
from quadvis.machine.processes import launching
from quadvis.native.choice import Announce
from quadvis.realtime.application import GRACE
from quadvis.realtime.cables import Cables
from quadvis.realtime.devices import Devices
from quadvis.realtime.flight import Flight
from quadvis.realtime.guardian import Standing
from quadvis.realtime.helm import Helm
from quadvis.realtime.last_ticks import LastTicks
from quadvis.realtime.lines import Lines
from quadvis.realtime.member import Member
from quadvis.realtime.note_taker import NoteTaker
from quadvis.realtime.options import RealTime
from quadvis.realtime.priorities import ladders
from quadvis.realtime.steering import Steering

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

LEAD = 20_000_000  # ns from the moment when all are ready to the start
HANG = 5.0  # s after which a step that has not ended is ended, and who has not ended with the others
LOOK = 0.02  # s between two looks at the rings
SHORTEST = 0.002  # s; a wait for something to come is longer, since it may last one millisecond too long

UNSAFE = "its outputs may not be at their safe values"


def supervise(
    diagram: Diagram,
    wishes: RealTime,
    engine: str,
    taps: Sequence[Tap],
    taker: NoteTaker,
    tend: Callable[[float, float], None],
    announce: Announce | None = None,
    helm: Helm | None = None,
    changed: Callable[[Change], None] | None = None,
) -> Flight:
    """Run a diagram in real time to its stop time, each computer in a process of its own.

    ``wishes`` have been checked. ``taps`` take rows here, ``taker`` what the loops note, before the rows of
    later ticks. ``tend`` is called again and again while it runs, with the time of the last tick and the time
    since the start (s). With a ``helm`` the run waits until this lets it begin; ``changed`` takes each
    parameter that it tunes, before the rows of the tick from which it holds.

    RunError if a block fails, if the tasks have too many overruns, if a step does not end, or if a process is
    killed. A computer that the others can do without does not end the run: it is given up, and its share says
    why. However this ends, all processes have ended then, and all rows have been handed on.
    """
    steering = Steering(helm, diagram, changed or _nothing)
    try:
        supervisor = _Supervisor(diagram, wishes, engine, taps, taker, announce or _nothing, steering)
    except BaseException:
        steering.end()
        raise
    try:
        return supervisor.follow(tend)
    except BaseException as error:
        try:
            notes = supervisor.end()
        except BaseException as again:  # one that came before it was held back, or was held back
            for note in supervisor.end():
                again.add_note(note)
            raise
        for note in notes:
            error.add_note(note)
        raise
    finally:
        steering.end()


class _Supervisor:
    def __init__(
        self,
        diagram: Diagram,
        wishes: RealTime,
        engine: str,
        taps: Sequence[Tap],
        taker: NoteTaker,
        announce: Announce,
        steering: Steering,
    ) -> None:
        self._steering = steering
        context = multiprocessing.get_context("spawn")
        self._announce = announce
        asked = {name: wishes.on(diagram.computer(name)) for name in diagram.computers}
        ladder = ladders(diagram, asked)
        priority = max(each.priority or 0 for each in asked.values())
        standing = Standing.to(list(asked.values()))
        self._devices = Devices(context, diagram.graph_here, diagram.on_host_loss, standing)
        self._lines = Lines(context, diagram.links_here, diagram.computers)
        self._cables = Cables(context, [*self._devices.cables, *self._lines.cables], priority)
        self._members = []
        last_ticks = context.RawArray("q", len(diagram.computers))
        for place, computer in enumerate(diagram.computers):
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
                    ladder[computer],
                    engine,
                    own,
                    taker,
                    steering.noted,
                    bindings,
                    self._lines.shared(computer),
                    LastTicks(last_ticks, place),
                    announce,
                    steering.is_watched,
                )
            )
        needed = [member for member in self._members if not member.is_dispensable] or self._members
        self._spare = [member for member in self._members if member not in needed]
        self._last_need = time.monotonic()  # when a process was last seen that is needed
        steering.take_over(self._members)
        self._begun = self._stopping = False
        self._unsafe: list[str] = []  # what may be without its safe values, in sentences

    def follow(self, tend: Callable[[float, float], None]) -> Flight:
        """Start the applications and hand rows on until they have ended; an error if this is too early."""
        self._start()
        while any(member.process.is_alive() for member in self._members):
            self._wait()
            reached = self._steering.tick
            self._look()
            self._steering.settle(reached)
            if alarm := self._devices.alarm():
                raise self._stopped(alarm.reason, alarm.block)
            if not self._begun and all(member.ready for member in self._members):
                self._begun = self._steering.may_begin()
                if self._begun:
                    self._begin()
            self._steering.look()
            if self._steering.is_stopped and not self._stopping:
                self._stop()
            running = [member for member in self._members if member.is_lasting]
            if running:
                tend(min(member.time for member in running), running[0].now)
            for member in running:
                member.warn()
                self._check_step(member)
            self._check_rest()
        self._look(last=True)
        self._steering.settle(max(member.tick for member in self._members), last=True)
        if unsafe := self._close():
            raise RunError("; ".join(unsafe))
        first = self._members[0]
        tend(min(member.time for member in self._members if not member.loss), first.now)
        for member in self._members:
            member.warn(last=True)
        return Flight(
            tuple(member.share() for member in self._members),
            sum(member.lost for member in self._members),
            *self._steering.early(),
        )

    def _wait(self) -> None:
        """Wait until it is time for a look at everything; meanwhile do what the helm wants, and answer it."""
        due = time.monotonic() + LOOK
        while (left := due - time.monotonic()) > 0 and not self._waited(left):
            if not self._begun or (self._steering.is_stopped and not self._stopping):
                return
            self._steering.look()

    def _waited(self, most: float) -> bool:
        """Wait for something to come, so long (s) at most; return whether anyone but the helm has come."""
        pause = self._steering.pause
        if pause < SHORTEST:
            time.sleep(pause)
            return False
        sources = [*(source for member in self._alive for source in member.sources), *self._devices.sources]
        came = wait([*sources, *self._steering.sources], min(most, pause - SHORTEST / 2))
        return any(source in sources for source in came)

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
        silent = [member for member in self._members if member.ended_silently and not member.loss]
        return [*self._unsafe, *([UNSAFE] if not all(member.is_guarded for member in silent) else [])]

    def _start(self) -> None:
        """Start all processes at once; the applications open no block before the guardian has the ports."""
        self._cables.start()
        vital = [member.patience for member in self._members if member not in self._spare]
        guardian = self._devices.start(vital)
        with launching():
            for member in self._members:
                member.start()
        self._cables.make()
        self._lines.lay(self._cables.ends)
        if guardian is not None:
            self._cables.watch(guardian)
        self._open_devices()
        for member in self._members:
            process = member.process.pid or 0
            self._devices.watch(process, member not in self._spare)
            self._cables.watch(process)
            member.supply(self._lines.of(member.computer), self._devices.ports)

    def _open_devices(self) -> None:
        """Let the outputs have their initial frames; RunError has a sentence for each port that is missing.

        So the outputs that are there are safe before anything else is found to be missing.
        """
        refusal = ""
        try:
            self._devices.open(self._cables.ends, self._announce)
        except RunError as error:
            refusal = str(error)
        missing = [*self._devices.missing(), *self._lines.missing()]
        if refusal and refusal not in missing:
            missing.insert(0, refusal)
        if missing:
            raise RunError("\n".join(missing))

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
        self._steering.begin()
        start = self._steering.instant or time.monotonic_ns() + LEAD
        self._steering.began(start)
        for member in self._members:
            member.begin(start)

    def _stop(self) -> None:
        """Let all applications end before their next steps; a signal wakes those that sleep."""
        self._stopping = True
        if self._steering.is_safe_first:
            self._devices.make_safe()
        for member in self._alive:
            member.process.terminate()

    def _look(self, *, last: bool = False) -> None:
        """Take what has come; an error if an application has ended early."""
        for member in self._members:
            ended = not member.process.is_alive()
            self._take(member, last=last)
            if member.failed and (ended or member.ending) and not (self._stopping and member.stopped):
                if not self._begun or member not in self._spare:
                    raise self._cause(member)
                self._give_up(member)

    def _take(self, member: Member, *, last: bool) -> None:
        """Take what has come from an application; a signal waits until all of it is handed on."""
        with put_off(self._devices.make_safe):
            member.listen()
            member.take(last=last, between=self._steering.attend)

    def _cause(self, member: Member) -> QuadvisError:
        """Return why the run has ended early."""
        member.process.join(GRACE)
        return member.error()

    def _give_up(self, member: Member, reason: str = "") -> None:
        """Fly on without a computer."""
        member.give_up(reason)
        self._take(member, last=True)
        self._steering.lose(member.computer)

    def _check_rest(self) -> None:
        """Give up who has not ended with the others that it is there for."""
        now = time.monotonic()
        if any(member.process.is_alive() for member in self._members if member not in self._spare):
            self._last_need = now
        elif now > self._last_need + HANG:
            for member in self._alive:
                self._give_up(member, f"the application of '{member.computer}' has not ended with the others")

    def _check_step(self, member: Member) -> None:
        """End a step that has lasted far too long."""
        if member in self._spare:
            if complaint := member.lost_heart():
                self._give_up(member, complaint)
            return
        longest = member.hangs(HANG)
        if not longest:
            return
        raise self._stopped(f"the step has not ended after {longest:g} s")


def _nothing(_: object) -> None:
    """Take what nobody wants."""
