"""A member of a real-time run: the process of one computer, and what comes from it."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext
from multiprocessing.process import BaseProcess
from typing import TYPE_CHECKING, Any

from quadvis.diagram.sections.overload import WARN
from quadvis.engine.taps import Tap
from quadvis.errors import QuadvisError, RunError, counted
from quadvis.errors.caller import IS_COMMAND
from quadvis.graph.graph import Graph
from quadvis.native.choice import Announce
from quadvis.realtime import control, times
from quadvis.realtime.application import GRACE, Ending, Ready, Setup, Supply, perform
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.devices import PortBindings, guards_all
from quadvis.realtime.flight import Share
from quadvis.realtime.heartbeat import Heartbeat, Patience, Sign
from quadvis.realtime.last_ticks import LastTicks
from quadvis.realtime.lifeline import Lifeline
from quadvis.realtime.note_taker import NoteTaker
from quadvis.realtime.options import RealTime
from quadvis.realtime.pictures import Picture, PictureBox, picture_signals
from quadvis.realtime.profiles import BlockTimes, ProfileBox, ProfileRoom
from quadvis.realtime.ring import RecordRing, Words
from quadvis.realtime.schedule import NANOSECONDS, Schedule
from quadvis.realtime.streams import RowStream, StreamTaps, nothing, room_for, streams_of
from quadvis.realtime.tail import LogTail
from quadvis.realtime.times import TaskTimes
from quadvis.realtime.tuner import Tuned, box_room

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram

WARNED = 1.0  # s between two warnings


class Member:
    """One application: its process, the words that it shares, and the rows that come from it.

    ``part`` is the graph of the computer, with the base tick of the whole; ``lines`` has the words of its
    links in memory, ``ladder`` the priorities of its tasks. ``ready`` is what the application said before
    its run, ``ending`` what it said after it. ``loss`` says why the others fly on without it; "" if they do
    not.
    """

    def __init__(
        self,
        context: SpawnContext,
        diagram: Diagram,
        computer: str,
        part: Graph,
        wishes: RealTime,
        ladder: tuple[int, ...],
        engine: str,
        taps: Sequence[Tap],
        taker: NoteTaker,
        groups: Callable[[str, Words], None],
        devices: PortBindings,
        lines: Mapping[str, Any],
        last_ticks: LastTicks,
        announce: Announce,
        watched: bool,
    ) -> None:
        self.computer, self._part, self._announce = computer, part, announce
        self._taker, self._groups = taker, groups
        self._limits = diagram.overload_of(computer)
        self._streams = streams_of(part, taps)
        streams = tuple(stream for stream, _ in self._streams)
        rings = [stream.ring for stream in streams]
        rooms = tuple(room_for(task.period) for task in part.tasks)
        box = box_room(part)
        words = context.RawArray("q", SharedMemory.size(rooms, rings, box))
        self._shared = SharedMemory(words, rooms, rings, box)
        self._control = self._shared.control
        self._control[control.TICKS] = diagram.ticks
        Lifeline(self._control[control.LIFELINE]).make()
        self._link, self._theirs = context.Pipe()
        self._last_ticks = last_ticks
        self._picture_signals = picture_signals(part) if watched else []
        pictures = context.RawArray("q", PictureBox.size()) if self._picture_signals else None
        room = ProfileRoom.of(part, whole=wishes.profile)
        profiles = (context.RawArray("q", room.words), room) if watched or wishes.profile else None
        self._profiles = ProfileBox(*profiles) if profiles is not None else None
        self.measure(int(wishes.profile))
        setup = Setup(
            diagram.resolved, str(diagram.path.parent), diagram.path.name, diagram.own_blocks,
            IS_COMMAND.get(), computer, engine, wishes, ladder, rooms, streams, words, self._theirs, devices,
            lines, last_ticks, box, pictures, profiles, self._tail(),
        )  # fmt: skip
        self._pictures = PictureBox(pictures) if pictures is not None else None
        self._schedule = Schedule.of(part)
        self.patience = Patience.of(computer, words, self._schedule, self._limits)
        self._heart = Heartbeat(self.patience, time.monotonic_ns)
        spec = diagram.computer(computer)
        self.is_dispensable = spec is not None and spec.is_dispensable
        name = f"application {computer}".rstrip()
        self.process: BaseProcess = context.Process(target=perform, args=(setup,), name=name)
        self._listening, self._supplied = True, False
        self.ready: Ready | None = None
        self.ending: Ending | None = None
        self.loss = ""
        self._warned, self._overruns = 0.0, [0] * len(rooms)

    def _tail(self) -> LogTail | None:
        """Return where its rows belong in the log of the run, if there is one."""
        log = self._taker.log
        if log is None:
            return None
        streams = tuple(
            tuple(next((tap.topic for tap in own if tap.topic), "") for own in taps)
            for _, taps in self._streams
        )
        notes = (topics.get(self.computer, "") for topics in (log.left_out, log.releases))
        return LogTail(log.path, streams, *notes)

    def start(self) -> None:
        """Start the process, which loads the diagram and waits for its `supply`."""
        self.process.start()
        self._theirs.close()

    def supply(self, lines: Mapping[str, Any], ports: Mapping[str, str]) -> None:
        """Let the application open its blocks, and get ready to run; see `Supply`."""
        self._supplied = True
        with suppress(OSError):  # it may have ended
            self._link.send(Supply(lines, ports))

    def shift(self, shift: int) -> None:
        """Let each tick be due so much (ns) later than by the start."""
        self._control[control.SHIFT] = shift

    def measure(self, measurement: int) -> None:
        """Let the calls of blocks be timed while the number of the measurement is odd."""
        self._control[control.MEASUREMENT] = measurement

    def block_times(self) -> BlockTimes | None:
        """Return what the measurement that began last has found; None if nothing yet."""
        if self._profiles is None or self.ready is None:
            return None
        report = self._profiles.report(self.ready.methods, self._control[control.MEASUREMENT])
        return None if report is None else BlockTimes(report, report.first - self._control[control.START])

    def has_picture(self, path: str, port: str) -> bool:
        """Return whether a signal is a picture of this computer."""
        return (path, port) in self._picture_signals

    def picture(self, path: str, port: str) -> Picture | None:
        """Return the newest picture of a signal that is one; None if there is none yet."""
        assert self._pictures is not None
        return self._pictures.newest(self._picture_signals.index((path, port)) + 1)

    def rest(self) -> None:
        """Ask for no more pictures if nobody wants to see one."""
        if self._pictures is not None:
            self._pictures.rest()

    def end_at(self, ticks: int) -> None:
        """Let the application end after so many ticks, before it begins."""
        self._control[control.TICKS] = ticks

    def tuned(self) -> Tuned:
        """Return what tunes the application, which is ready."""
        assert self.ready is not None
        return Tuned(self._part, self._shared.box, self.ready.tunables)

    def begin(self, instant: int) -> None:
        """Let the application run from an instant (ns) of the monotonic clock on."""
        self._link.send(instant)

    @property
    def sources(self) -> list[Connection | int]:
        """What becomes ready when the application says something, or has ended."""
        return [self.process.sentinel, *([self._link] if self._listening else [])]

    @property
    def running(self) -> bool:
        """True from the start of the run on."""
        return bool(self._control[control.START])

    @property
    def tick(self) -> int:
        """The tick that began last."""
        return int(self._control[control.TICK])

    @property
    def time(self) -> float:
        """The time of the last tick (s)."""
        return float(self.tick * self._part.tick)

    @property
    def ticks(self) -> int:
        """How many ticks the run had, those left out included, now that it has ended."""
        if not (self.stopped or self.loss):
            return int(self._control[control.TICKS])
        return self.tick + 1 if self.running else 0

    def times(self) -> tuple[TaskTimes, ...]:
        """Return the times of the tasks up to now."""
        tasks = zip(self._part.tasks, self._shared.tasks, strict=True)
        return tuple(TaskTimes.read(task.name, float(task.period), words) for task, words in tasks)

    @property
    def now(self) -> float:
        """The time since the start (s)."""
        return max(0, self._instant) / NANOSECONDS

    @property
    def remaining(self) -> float:
        """The time until the next tick is due (s); below zero if the loop is late."""
        return (self._schedule.deadline(self.tick + 1) - self._instant) / NANOSECONDS

    @property
    def _instant(self) -> int:
        """The time since the start (ns)."""
        start = self._control[control.START] + self._control[control.SHIFT]
        return time.monotonic_ns() - start

    @property
    def lost(self) -> int:
        """How many rows found no room on the way here."""
        rows = sum(len(stream.blocks) * ring.lost for (stream, _), ring in self._rings)
        return rows + self._shared.notes.left_out.lost + self._shared.notes.releases.lost

    @property
    def failed(self) -> bool:
        """True if the application has ended before its stop time, or is about to, and others need it."""
        if self.loss:
            return False
        if self.ending is None:
            return not self.process.is_alive()
        return bool(self.ending.reason) and not self.ending.through

    @property
    def stopped(self) -> bool:
        """True if the application has ended because it was asked to."""
        return self.ending is not None and self.ending.asked

    @property
    def ended_silently(self) -> bool:
        """True if it has opened blocks and ended without a word, and so perhaps without its safe values."""
        return self._supplied and self.ending is None and self.process.exitcode is not None

    @property
    def is_guarded(self) -> bool:
        """True if the guardian has all outputs of the application."""
        return guards_all(self._part)

    @property
    def is_lasting(self) -> bool:
        """True if it runs, and has not been given up."""
        return self.running and not self.loss

    def give_up(self, reason: str = "") -> None:
        """Let the others fly on without it, for a reason, or because of what has ended it: kill it."""
        self.process.join(0 if reason else GRACE)
        self.loss = str(RunError(reason, time=self.moment) if reason else self.error())
        self.process.kill()
        self.process.join()
        self._last_ticks.leave()
        self._announce(f"{self.loss}; the other computers fly on without '{self.computer}'")

    def lost_heart(self) -> str:
        """Return a sentence if its loop hangs; else ""."""
        return self._heart.complaint if self._heart.look() is Sign.HANGS else ""

    def ask(self) -> None:
        """Ask for the end of the run before its next step."""
        self._control[control.END] = 1

    def take(self, *, last: bool = False, between: Callable[[], None] = nothing) -> None:
        """Hand on what the loop has noted, and the rows that have come; ``between`` is called now and then.

        Of all, what it has noted before a row that is handed on: the rows are taken first.
        """
        found = [(stream, taps, ring.take(last=last)) for (stream, taps), ring in self._rings]
        notes = self._shared.notes
        self._taker.left_out(self.computer, notes.left_out.take(last=last))
        self._groups(self.computer, notes.groups.take(last=last))
        self._taker.releases(self.computer, notes.releases.take(last=last))
        for task, ring in zip(self._part.tasks, notes.times, strict=True):
            self._taker.times(self.computer, task.name, ring.take(last=last))
        for stream, taps, records in found:
            stream.hand_on(records, taps, between)

    @property
    def _rings(self) -> Iterable[tuple[tuple[RowStream, StreamTaps], RecordRing]]:
        return zip(self._streams, self._shared.rings, strict=True)

    def listen(self) -> None:
        """Take what the application says before and after its run."""
        try:
            while self._listening and self._link.poll():
                said = self._link.recv()
                if isinstance(said, Ending):
                    self.ending = said
                elif isinstance(said, Ready):
                    self.ready = said
                    self._announce(f"real time{self._name(', ')}: {said.grants}")
                else:
                    self._announce(said)
        except (EOFError, OSError):
            self._listening = False

    def warn(self, *, last: bool = False) -> None:
        """Announce new overruns, at most once in a while and at the end."""
        found = [int(words[times.OVERRUNS]) for words in self._shared.tasks]
        if found == self._overruns or not (last or self.now >= self._warned + WARNED):
            return
        names = [task.name for task in self._part.tasks]
        more = [
            f"task '{name}'{self._name(' of ')} has {counted(now - before, 'more overrun')}"
            for name, before, now in zip(names, self._overruns, found, strict=True)
            if now > before
        ]
        self._announce(f"t = {self.time:.9g} s: {', '.join(more)}")
        self._warned, self._overruns = self.now, found

    def hangs(self, patience: float) -> float:
        """Return after how long (s) a step that has not ended counts as hanging, if it does now; else 0.

        That is ``patience``, or longer if the diagram allows longer steps.
        """
        begun = self._control[control.BEGUN] or self._control[control.RESTING]
        tasks = [(self._limits.of(task.name), float(task.period)) for task in self._part.tasks]
        longest = max(patience, *((limits.max + 1) * period for limits, period in tasks))
        lasting = any(limits.action == WARN for limits, _ in tasks)
        if not begun or lasting or self.now - begun / NANOSECONDS < longest:
            return 0.0
        return longest

    def share(self) -> Share:
        """Return what the computer did, after the run."""
        assert self.ready is not None
        ending, found = self.ending or Ending(), self.block_times()
        return Share(
            self.computer,
            self.ready.engine,
            self.ready.grants,
            self.times(),
            self.ticks,
            ending.unsafe,
            found,
            self.loss or (ending.problem if ending.through else ""),
        )

    def error(self) -> QuadvisError:
        """Return why the application has ended early."""
        if self.ending is not None:
            return self.ending.error()
        code = self.process.exitcode or 0
        what = (
            f"was killed by {signal.Signals(-code).name}" if code < 0 else f"has ended with exit code {code}"
        )
        return RunError(f"the application{self._name(' of ')} {what}", time=self.moment)

    @property
    def moment(self) -> float | None:
        """The time of the last tick (s); None before the start."""
        return self.time if self.running else None

    def _name(self, before: str) -> str:
        return f"{before}'{self.computer}'" if self.computer else ""
