"""The guardian: the process that owns the output ports of a real-time run.

It knows no block, only a table of ports and frames. It sends the initial frames as soon as the ports are
open, then the newest frame that each outbox holds. Once something ends (an application that dies or hangs,
unless the others can do without it, the request to end, an order of the supervisor, the supervisor's death, a
port that is lost) it sends the safe frames and nothing else, until the supervisor has ended everything, or
until nobody lives whom it works for.
"""

from __future__ import annotations

import os
import select
import signal
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import partial
from multiprocessing.connection import Connection
from typing import Any, NamedTuple

from quadvis.block.output import LONGEST
from quadvis.diagram.sections.on_host_loss import SAFE
from quadvis.machine.interrupts import leave_to_parent
from quadvis.machine.mailbox import Mailbox
from quadvis.machine.ports import ChannelError, PortError
from quadvis.realtime.heartbeat import Heartbeat, Patience, Sign
from quadvis.realtime.lifeline import SIZE, Vigil
from quadvis.realtime.lives import Lives
from quadvis.realtime.news import NewsOutlet, news_of
from quadvis.realtime.options import HIGHEST, RealTime
from quadvis.realtime.outlet import Outlet, OutputPort
from quadvis.realtime.schedule import NANOSECONDS
from quadvis.realtime.shared_ports import SharedPorts
from quadvis.realtime.system import Grants, ask_all

LONGEST_LOOK, SHORTEST_LOOK = 10_000_000, 1_000_000  # ns between two looks at the loops
LOOKS = 8  # at a loop in the time that it is allowed to be silent
FAREWELL = 3  # safe frames at least, before the ports are closed
LAST = NANOSECONDS  # ns that these may take, once the device has started
PLACES = 3  # of an outbox
OUTBOX = Mailbox.size(LONGEST, PLACES)  # words


class Standing(NamedTuple):
    """How the guardian stands to the loops: its ``priority`` (0: none), and the processors that it avoids.

    It stands above all loops, so that none that hangs keeps it from a processor; and beside them, since a
    processor is not free until a loop that was killed there has given its memory back.
    """

    priority: int = 0
    avoided: frozenset[int] = frozenset()

    @staticmethod
    def to(loops: Sequence[RealTime]) -> Standing:
        """Return how it stands to these loops."""
        highest = max(loop.priority or 0 for loop in loops)
        avoided = frozenset(loop.cpu for loop in loops if loop.cpu is not None)
        return Standing(min(HIGHEST, highest + 1) if highest else 0, avoided)


@dataclass(frozen=True)
class GuardianSetup:
    """What the guardian needs: ``words`` has an outbox for each of the ``ports``, in their order.

    Its process starts without ports, and takes them from the ``link``. ``patiences`` are those with vital
    loops. ``supervisor`` is the process that started it, ``on_host_loss`` what its death means. ``readers``
    get the descriptors of shared ports, by path.
    """

    ports: tuple[OutputPort, ...]
    words: Any
    patiences: tuple[Patience, ...]
    link: Connection
    supervisor: int
    on_host_loss: str
    standing: Standing
    readers: Mapping[str, Connection] = field(default_factory=dict)


class Order(Enum):
    """What the supervisor asks for."""

    SAFE = "send safe frames from now on"
    CLOSE = "close the ports: everything else has ended"


@dataclass(frozen=True)
class Watch:
    """The supervisor names the process of an application; a ``vital`` one must not end."""

    process: int
    vital: bool = True


@dataclass(frozen=True)
class Guarding:
    """The ports are open and have their initial frames; what the system has granted."""

    grants: Grants


@dataclass(frozen=True)
class Alarm:
    """Why the guardian has begun to send safe frames, if the supervisor cannot know: of a block, or none."""

    reason: str
    block: str = ""


def outboxes(words: Any) -> list[Mailbox]:
    """Return the outboxes that words hold: mailboxes for frames of at most ``LONGEST`` bytes."""
    view = memoryview(words).cast("B").cast("q")
    starts = range(0, len(view) - len(view) % OUTBOX, OUTBOX)
    return [Mailbox(view[start : start + OUTBOX], LONGEST, PLACES) for start in starts]


def looked(words: Any) -> Any:
    """Return the word after the outboxes: when the guardian last looked at the loops (ns)."""
    return memoryview(words).cast("B").cast("q")[-1:]


def supervisor_lifeline(words: Any) -> Any:
    """Return the words before that: the lifeline of the supervisor."""
    return memoryview(words).cast("B").cast("q")[-1 - SIZE : -1]


def words_for(ports: int) -> int:
    """Return the number of words of the guardian of so many ports."""
    return ports * OUTBOX + SIZE + 1


def _newest_frame(box: Mailbox) -> bytes | None:
    found = box.newest()
    return found.payload if found is not None else None


class Guardian:
    """The work of the guardian's process, look by look."""

    def __init__(self, setup: GuardianSetup) -> None:
        self._setup, self._link = setup, setup.link
        self._shared = SharedPorts()
        boxes = zip(setup.ports, outboxes(setup.words), strict=True)
        self._outlets = [self._outlet(port, box) for port, box in boxes]
        self._looked = looked(setup.words)
        self._hearts = [Heartbeat(patience, time.monotonic_ns) for patience in setup.patiences]
        self._supervisor, self._applications, self._vital = Lives(), Lives(), Lives()
        self._supervisor.watch(setup.supervisor)
        self._vigil = Vigil(supervisor_lifeline(setup.words), setup.standing.priority)
        shortest = min([patience.allowed // LOOKS for patience in setup.patiences], default=LONGEST_LOOK)
        self._look_every = min(max(shortest, SHORTEST_LOOK), LONGEST_LOOK)
        self._parting = max([port.parting for port in setup.ports], default=0)
        self._partly: list[Outlet] = []  # whose loss has been reported
        self.safe = self._paused = False
        self._closing = 0  # the instant at which it was told to close
        self._listening = True
        self.told_to_end = False

    def _outlet(self, port: OutputPort, box: Mailbox) -> Outlet:
        taken, open_port = self._shared.taken(port)
        if port.news:
            return NewsOutlet(taken, news_of(box), open_port)
        return Outlet(taken, partial(_newest_frame, box), open_port)

    def open(self) -> bool:
        """Open all ports; if one refuses, the others have their safe frames before this is reported."""
        refused = []
        for outlet in self._outlets:
            try:
                outlet.open()
            except PortError as error:
                refused.append((outlet, error))
        for outlet, refusal in refused:
            self._fail(outlet, refusal)
        self._shared.lend(self._setup.readers)
        return not refused

    def run(self) -> None:
        """Serve the ports until nobody needs them any more."""
        while not self._finished:
            self.look()
            self._wait()
        self._finish()

    def _finish(self) -> None:
        """Close all ports."""
        for outlet in self._outlets:
            outlet.finish(time.monotonic_ns())

    def look(self) -> None:
        """Look at everything once, and send what is due."""
        self._listen()
        self._watch()
        now = time.monotonic_ns()
        self._looked[0] = now
        for outlet in self._outlets:
            try:
                outlet.serve(now, safe=self.safe or self._paused)
            except PortError as error:
                self._fail(outlet, error)

    @property
    def _finished(self) -> bool:
        now = time.monotonic_ns()
        orphaned = self._supervisor.any_ended and self._applications.all_ended
        if orphaned or (self.told_to_end and self._applications.all_ended):
            self._make_safe()
            self._closing = self._closing or now
        if not self._closing:
            return False
        served = all(outlet.has_its_farewell(FAREWELL) for outlet in self._outlets)
        return served or now - self._closing > LAST + self._parting

    def _watch(self) -> None:
        """Look at the loops and at the lives of everybody."""
        self._supervisor.look()
        self._applications.look()
        self._vital.look()
        # Each life is looked at, whatever is known already: an end that is not looked at keeps it awake.
        host_lost = self._vigil.has_ended() or self._supervisor.any_ended
        if (host_lost and self._setup.on_host_loss == SAFE) or self._vital.any_ended:
            self._make_safe()
        if self.told_to_end and not self.safe:
            self._make_safe(Alarm("the guardian was told to end"))
        for heart in self._hearts:
            heart.hold_on(self._setup.standing.priority)
        signs = [(heart.look(), heart) for heart in self._hearts]
        kinds = set() if self.safe else {sign for sign, _ in signs}
        if Sign.ENDS in kinds:
            self._make_safe()
        for sign, heart in signs:
            if sign is Sign.HANGS and not self.safe:
                self._make_safe(Alarm(heart.complaint))
        paused = Sign.PAUSES in kinds
        if paused and not self._paused:
            self._hurry()
        self._paused = paused

    def _listen(self) -> None:
        """Take what the supervisor says."""
        try:
            while self._listening and self._link.poll():
                said = self._link.recv()
                if isinstance(said, Watch):
                    self._applications.watch(said.process)
                    if said.vital:
                        self._vital.watch(said.process)
                else:
                    self._make_safe()
                    if said is Order.CLOSE:
                        self._closing = time.monotonic_ns()
        except (EOFError, OSError):
            self._listening = False

    def _make_safe(self, alarm: Alarm | None = None) -> None:
        """Send safe frames at once, and from now on."""
        if not self.safe:
            self.safe = True
            self._hurry()
            for outlet in self._outlets:
                with suppress(PortError):  # the next frame meets it again, and reports it
                    outlet.serve(time.monotonic_ns(), safe=True)
        if alarm is not None:
            with suppress(OSError):  # the supervisor may have ended
                self._link.send(alarm)

    def _hurry(self) -> None:
        now = time.monotonic_ns()
        for outlet in self._outlets:
            outlet.hurry(now)

    def _fail(self, outlet: Outlet, error: PortError) -> None:
        """Give up a port, and report it once the others are safe; one that has channels left is kept."""
        if not isinstance(error, ChannelError):
            outlet.close()
        elif outlet in self._partly:
            return
        self._partly.append(outlet)
        self._make_safe(Alarm(str(error), outlet.port.block))

    def _wait(self) -> None:
        """Sleep until a frame is due, a look is due, or something happens."""
        now = time.monotonic_ns()
        due = min([outlet.due for outlet in self._outlets if outlet.is_open], default=now + LONGEST_LOOK)
        until = min(due, now + self._look_every)
        select.select(self._sources, [], [], max(0, until - now) / NANOSECONDS)

    @property
    def _sources(self) -> list[Any]:
        """What becomes readable when something happens."""
        sources: list[Any] = [*self._supervisor.descriptors, *self._applications.descriptors]
        sources += self._vigil.descriptors
        sources += [descriptor for heart in self._hearts for descriptor in heart.descriptors]
        return sources + ([self._link] if self._listening else [])


def guard(setup: GuardianSetup) -> None:
    """Be the guardian: the whole life of its process."""
    os.setsid()  # no terminal stops it (Ctrl-Z) or kills it
    leave_to_parent()
    try:
        ports = setup.link.recv()
    except EOFError:  # the supervisor has ended
        return
    if isinstance(ports, Order):  # the run ends before it has begun
        return
    guardian = Guardian(replace(setup, ports=ports))

    def end(*_: object) -> None:
        guardian.told_to_end = True

    for number in (signal.SIGTERM, signal.SIGABRT):  # systemd's watchdog sends SIGABRT to all of a service
        signal.signal(number, end)
    if others := os.sched_getaffinity(0) - setup.standing.avoided:
        os.sched_setaffinity(0, others)
    grants = ask_all(RealTime(priority=setup.standing.priority))
    opened = guardian.open()
    guardian.look()
    if opened:
        setup.link.send(Guarding(grants))
    guardian.run()
