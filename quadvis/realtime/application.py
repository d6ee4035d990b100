"""The application: the process in which the loop of a real-time run is, and little else.

It loads the resolved diagram, opens the blocks, asks the system for what it wants, and runs. While it runs it
writes no file and no text, and uses no socket: rows, times and the present tick go into shared memory.

SIGTERM ends the run before its next step; a second one ends the step that is running. Then, as at every end
but SIGKILL, the safe values are written and the blocks closed. The terminal's signals go to the
supervisor alone. If the supervisor has ended, so does this process.
"""

from __future__ import annotations

import os
import signal
import threading
import time
import traceback
from collections.abc import Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import dataclass, replace
from multiprocessing import parent_process
from multiprocessing.connection import Connection
from multiprocessing.reduction import ForkingPickler
from typing import Any, NamedTuple

from quadvis.diagram.load import load_text
from quadvis.diagram.sections.on_host_loss import CONTINUE
from quadvis.engine.engine import Engine
from quadvis.engine.profile import TimedMethod
from quadvis.engine.program import Tunable
from quadvis.errors import QuadvisError, RunError
from quadvis.errors.caller import IS_COMMAND
from quadvis.graph.graph import MULTI, Graph
from quadvis.links.endpoints import close_all, live, open_carriers
from quadvis.machine.failures import surroundings
from quadvis.machine.interrupts import leave_to_parent
from quadvis.native.choice import NATIVE, PYTHON, Choice, choose, interpreted, use
from quadvis.native.executor import last_exact
from quadvis.realtime import control
from quadvis.realtime.captures import Captures
from quadvis.realtime.clocks import MonotonicClock
from quadvis.realtime.control import SharedMemory
from quadvis.realtime.crew import Crew, lead
from quadvis.realtime.devices import PortBindings
from quadvis.realtime.hold_ups import hold_ups
from quadvis.realtime.last_ticks import LastTicks
from quadvis.realtime.lifeline import Lifeline
from quadvis.realtime.options import RealTime
from quadvis.realtime.pacer import Ended, Pacer
from quadvis.realtime.pictures import PictureBox, picture_signals
from quadvis.realtime.profiles import ProfileBox, ProfileRoom
from quadvis.realtime.reports import Reports
from quadvis.realtime.schedule import NANOSECONDS, Schedule
from quadvis.realtime.streams import RowStream
from quadvis.realtime.system import SHARE, Grants, ask_all, raise_thread, wake_up_time
from quadvis.realtime.tail import LogTail
from quadvis.realtime.warm import warm

GRACE = 2.0  # s that a step has to end, once it was asked to


@dataclass(frozen=True)
class Setup:
    """What an application needs: a resolved diagram, how to run it, what it shares with its supervisor.

    ``computer`` is the one whose blocks it runs, "" in a diagram without computers. ``ladder`` has the
    priorities of its tasks. ``rooms`` are those of the notes, ``box`` that of the parameter box; ``pictures``
    are the words of the picture box, if there is one, and ``profiles`` those of its blocks' times, with their
    size, if somebody may ask for them. ``lines`` has the words of its links in memory, by their names.
    ``tail`` says where rows belong that no supervisor has taken.
    """

    text: str
    folder: str
    name: str
    own_blocks: bool
    is_command: bool
    computer: str
    engine: str
    wishes: RealTime
    ladder: tuple[int, ...]
    rooms: tuple[int, ...]
    streams: tuple[RowStream, ...]
    words: Any
    link: Connection
    devices: PortBindings
    lines: Mapping[str, Any]
    last_ticks: LastTicks
    box: int
    pictures: Any
    profiles: tuple[Any, ProfileRoom] | None
    tail: LogTail | None


class Supply(NamedTuple):
    """What an application waits for before it opens its blocks, since other processes make it.

    ``lines`` has what the ends of its other links are opened with, by the names of the links; ``ports`` the
    ptys of its input devices, by their paths.
    """

    lines: Mapping[str, Any]
    ports: Mapping[str, str]


@dataclass(frozen=True)
class Ready:
    """The application can begin: what the system has granted, which engine runs, where parameters are.

    ``methods`` are those whose calls can be timed, for each thread.
    """

    grants: Grants
    engine: Choice
    tunables: tuple[Tunable, ...] = ()
    methods: Sequence[Sequence[TimedMethod]] = ()


@dataclass(frozen=True)
class Ending:
    """How an application has ended: at its stop time if ``reason`` is "", else why.

    ``exit_code`` is that of the error, ``asked`` says that somebody has asked for the end, ``unsafe``
    why the outputs have held their safe values before the end, if they have. ``through`` says that all ticks
    have run, and that the reason came up at the end, such as a device that was gone then.
    """

    reason: str = ""
    block: str = ""
    port: str = ""
    time: float | None = None
    notes: tuple[str, ...] = ()
    exit_code: int = RunError.exit_code
    asked: bool = False
    unsafe: str = ""
    through: bool = False

    @staticmethod
    def of(error: BaseException) -> Ending:
        """Return the ending that an error is."""
        notes = tuple(getattr(error, "__notes__", ()))
        if isinstance(error, RunError):
            return Ending(error.reason, error.block, error.port, error.time, notes)
        if isinstance(error, QuadvisError):
            return Ending(str(error), notes=notes, exit_code=error.exit_code)
        words = surroundings(error) or "".join(traceback.format_exception(error))
        return Ending(words, notes=notes)

    @property
    def problem(self) -> str:
        """What went wrong, in a sentence with its place; "" if nothing did."""
        return "; ".join([str(self.error()), *self.notes]) if self.reason else ""

    def error(self) -> QuadvisError:
        """Return the error, to be raised."""
        made: QuadvisError
        if self.exit_code == RunError.exit_code:
            made = RunError(self.reason, block=self.block, port=self.port, time=self.time)
        else:
            made = QuadvisError(self.reason)
        for note in self.notes:
            made.add_note(note)
        return made


class Interrupted(BaseException):
    """The process is to end, in the middle of what it does."""


class _Signals:
    """SIGTERM as the request to end; it raises `Interrupted` where no step is about to end."""

    def __init__(self, words: Any) -> None:
        self._words, self._asked = words, False
        self.looping = self.closing = False
        signal.signal(signal.SIGTERM, self._take)

    def _take(self, *_: object) -> None:
        asked, self._asked = self._asked, True
        self._words[control.END] = 1
        if not self.closing and (asked or not self.looping):
            raise Interrupted

    def close(self) -> None:
        """Let nothing interrupt the closing of the blocks."""
        self.closing = True


class _Application:
    """One run, from the resolved diagram to the closed blocks."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        rings = [stream.ring for stream in setup.streams]
        self._shared = SharedMemory(setup.words, setup.rooms, rings, setup.box)
        self._signals = _Signals(self._shared.control)
        self._engine: Engine | None = None
        self._pacer: Pacer | None = None
        self._start = 0
        self.goes_on_alone = False  # true from the start of a run that may lose its supervisor
        self._through = False

    def run(self) -> Ending:
        """Run to the stop time."""
        setup, shared = self._setup, self._shared
        diagram = load_text(setup.text, setup.folder, setup.name, setup.own_blocks)
        part = diagram.graph.part_of(setup.computer)
        schedule = Schedule.of(part)
        names, overload = [task.name for task in part.tasks], diagram.overload_of(setup.computer)
        limits, clock = [overload.of(name) for name in names], MonotonicClock()
        pacer = self._pacer = Pacer(
            schedule, names, limits, shared, clock, lambda: engine.hold_safe(), setup.computer,
            lambda number: engine.time_calls(number),
        )  # fmt: skip
        supply: Supply = setup.link.recv()
        with ExitStack() as stack:
            carriers = open_carriers(part, {**setup.lines, **supply.lines})
            stack.callback(close_all, carriers.values())
            engine = self._engine = Engine(live(part, carriers), diagram.seed, pacer)
            pacer.write_into(engine.memory)
            setup.devices.bind(engine, supply.ports, Reports(setup.link, clock).take)
            captures = stack.enter_context(Captures(engine, clock))
            captures.start()
            if setup.profiles is not None:
                engine.measure(ProfileBox(*setup.profiles).new)
            choice = choose(engine, diagram.ticks, setup.engine, setup.link.send, paced=True)
            native = choice.engine == NATIVE and diagram.ticks <= last_exact(engine.period)
            crew = self._crew(part, choice if native else Choice(PYTHON), pacer)
            if crew is None:
                use(engine, choice, pacer if native else None)
            for stream, ring in zip(setup.streams, shared.rings, strict=True):
                stream.put_into(ring, engine, native)
            if setup.pictures is not None:
                PictureBox(setup.pictures).put_from(engine, picture_signals(part), clock)
            engine.prepare()
            for note in captures.wait():
                setup.link.send(note)
            stack.enter_context(diagram.guarded())
            stack.enter_context(engine)
            stack.callback(self._leave)
            warm(engine, choice)
            grants = ask_all(replace(setup.wishes, priority=setup.ladder[0]))
            if native:
                clock.hear_signals()
            clock.polled = _polled(setup.wishes, schedule, clock)
            grants.granted.append(f"polling {clock.polled / 1e3:.0f} us")
            grants.refused += [note for carrier in carriers.values() for note in carrier.notes]
            Lifeline(shared.control[control.LIFELINE]).hold()
            engine_chosen = Choice(choice.engine, choice.reason)
            setup.link.send(Ready(grants, engine_chosen, engine.program.tunables, engine.timed_methods))
            self._start = clock.start = setup.link.recv()  # all applications begin at one instant
            shared.control[control.START] = self._start
            ticks = shared.control[control.TICKS]
            engine.end_before(ticks)
            self.goes_on_alone = diagram.on_host_loss == CONTINUE
            self._signals.looping = True
            if crew is not None:
                stack.callback(crew.leave)
                crew.start(ticks)
            engine.run(ticks)
            pacer.finish()
            if crew is not None:
                pacer.conclude(crew.rest, ticks)
            remaining = schedule.deadline(ticks) - clock.now()
            setup.last_ticks.stay(remaining / NANOSECONDS, schedule.interval / NANOSECONDS, pacer.live)
            if shared.control[control.END]:
                raise Ended
            self._through = True
        return self._ending()

    def _crew(self, part: Graph, choice: Choice, pacer: Pacer) -> Crew | None:
        """Let each task run by itself, if the diagram wants it so."""
        engine = self._engine
        assert engine is not None
        if part.tasking != MULTI:
            return None
        for sentence in hold_ups(part, interpreted(engine, choice)):
            self._setup.link.send(sentence)
        return lead(engine, choice, pacer, self._tend)

    def _tend(self, task: int) -> None:
        """Give the thread of a task its priority, see `quadvis.realtime.priorities`."""
        if priority := self._setup.ladder[task]:
            raise_thread(priority)

    def _leave(self) -> None:
        """Let the guardian know that no step follows, and nothing interrupt the closing of the blocks."""
        self._shared.control[control.LEFT] = 1
        self._signals.close()

    def ended_early(self, error: BaseException) -> Ending:
        """Return the ending of a run that was asked to end."""
        engine = self._engine
        if engine is None or not self._start:
            return Ending("the application was told to end", asked=True)
        block = _running(error, engine) if isinstance(error, Interrupted) else ""
        told = "the application was told to end"
        return replace(self._ending(), reason=told, block=block, time=engine.time, asked=True)

    def failed(self, error: Exception) -> Ending:
        """Return the ending of a run in which something went wrong, perhaps only after its last tick."""
        ending = Ending.of(error)
        if not self._through:
            return ending
        usual = self._ending()
        return replace(ending, unsafe=usual.unsafe, through=True)

    def _ending(self) -> Ending:
        """Return how a run ends that has begun."""
        assert self._pacer is not None
        return Ending(unsafe=self._pacer.unsafe)

    def add_tail(self) -> None:
        """Add to the log what a supervisor that has died could not."""
        setup, parent = self._setup, parent_process()
        if self._start and self._engine is not None and setup.tail and not (parent and parent.is_alive()):
            setup.tail.add(setup.streams, self._shared, self._engine.period)


def perform(setup: Setup) -> None:
    """Run an application: the whole life of its process."""
    application = _Application(setup)
    os.setsid()  # no terminal stops it (Ctrl-Z) or kills it
    leave_to_parent()
    threading.Thread(target=_end_with_parent, args=(application,), daemon=True).start()
    IS_COMMAND.set(setup.is_command)
    no_memory = ForkingPickler.dumps(Ending.of(MemoryError()))  # made while there is some
    try:
        ending = application.run()
    except (Ended, Interrupted) as error:
        ending = application.ended_early(error)
    except Exception as error:
        ending = application.failed(error)
    with suppress(OSError):  # the supervisor may have ended
        try:
            setup.link.send(ending)
        except MemoryError:
            setup.link.send_bytes(no_memory)
    application.add_tail()


def _polled(wishes: RealTime, schedule: Schedule, clock: MonotonicClock) -> int:
    """Return how long (ns) before each deadline the loop is to look at the clock."""
    polled = wishes.polled()
    return min(wake_up_time(clock), schedule.interval // SHARE) if polled is None else polled


def _running(error: BaseException, engine: Engine) -> str:
    """Return the path of the block that an exception has interrupted; "" if none was running."""
    blocks = {id(engine.bound(block.path)): block.path for block in engine.program.blocks}
    found = ""
    trace = error.__traceback__
    while trace is not None:
        found = blocks.get(id(trace.tb_frame.f_locals.get("self")), found)
        trace = trace.tb_next
    return found


def _end_with_parent(application: _Application) -> None:
    """End this process when its supervisor has ended, unless its run may go on: orderly if possible."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        if application.goes_on_alone:
            return
        for _ in range(2):
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(GRACE)
        os._exit(1)
