"""The guardian, look by look: what makes it send safe frames, and to whom."""

from __future__ import annotations

import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import Pipe
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from quadvis.diagram.sections.on_host_loss import CONTINUE, SAFE, STOP
from quadvis.machine.ports import Card, ChannelError, OpenPort
from quadvis.machine.serial_port import Line
from quadvis.realtime import control
from quadvis.realtime.guardian import (
    LAST,
    Alarm,
    Guardian,
    GuardianSetup,
    Order,
    Standing,
    Watch,
    outboxes,
    supervisor_lifeline,
    words_for,
)
from quadvis.realtime.heartbeat import Patience
from quadvis.realtime.lifeline import Lifeline
from quadvis.realtime.options import RealTime
from quadvis.realtime.outlet import Outlet, OutputPort
from quadvis.realtime.schedule import NANOSECONDS
from tests.processes import wait_for
from tests.quadvis.realtime.ptys import Pty, ptys

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="ports are Linux's")

MS = 10**6
LINE = Line(10**6)


class Rig:
    """A guardian of two ports in this process, a loop's words, and small processes for it to watch."""

    def __init__(self, lines: list[Pty], on_host_loss: str = SAFE, lasting: bool = True) -> None:
        self.ptys = lines
        self.control = np.zeros(control.WORDS, np.int64)
        self.words = np.zeros(words_for(len(lines)), np.int64)
        self.loop_ends, self.host_ends = threading.Event(), threading.Event()
        self.live(self.control[control.LIFELINE], self.loop_ends)
        self.live(supervisor_lifeline(self.words), self.host_ends)
        self.link, theirs = Pipe()
        self.started: list[subprocess.Popen[bytes]] = []
        self.supervisor = self.process()
        ports = [
            OutputPort(f"out{number}", line.path, LINE, 5 * MS, b"first", b"safe!")
            for number, line in enumerate(lines)
        ]
        self.other = np.zeros(control.WORDS, np.int64)  # of a second loop, which has not started
        patience = Patience("", self.control, 50 * MS, lasting=lasting)
        patiences = (patience, Patience("other", self.other, 50 * MS))
        setup = GuardianSetup(
            tuple(ports), self.words, patiences, theirs, self.supervisor.pid, on_host_loss, Standing()
        )
        self.guardian = Guardian(setup)
        self.boxes = outboxes(self.words)

    @staticmethod
    def live(words: Any, end: threading.Event) -> None:
        """Have a thread live until it is to end."""
        line, held = Lifeline(words), threading.Event()
        line.make()

        def hold() -> None:
            line.hold()
            held.set()
            end.wait()

        threading.Thread(target=hold, daemon=True).start()
        held.wait()

    def process(self) -> subprocess.Popen[bytes]:
        """Start a process that does nothing."""
        self.started.append(subprocess.Popen(["sleep", "1000"]))
        return self.started[-1]

    def until(self, condition: Any) -> None:
        """Look again and again until something is the case."""

        def look() -> bool:
            self.guardian.look()
            return bool(condition())

        wait_for(look)

    def until_wire(self, *frames: bytes) -> None:
        """Look until the newest bytes of each port are its frame, twice."""
        for line, frame in zip(self.ptys, frames, strict=True):
            self.until(lambda line=line, frame=frame: line.read().endswith(2 * frame))

    def follow(self) -> None:
        """Let a watched application command both ports."""
        self.application = self.process()
        self.link.send(Watch(self.application.pid))
        for box in self.boxes:
            box.put(b"going")
        self.until_wire(b"going", b"going")
        assert not self.guardian.safe

    def alarms(self) -> list[Alarm]:
        """Return the alarms that were raised."""
        found = []
        while self.link.poll():
            found.append(self.link.recv())
        return found

    def stays_safe(self) -> None:
        """Check that both ports have safe frames, and no others after them, whatever the loop does."""
        self.until_wire(b"safe!", b"safe!")
        for box in self.boxes:
            box.put(b"again")
        before = [len(line.read()) for line in self.ptys]
        self.until(
            lambda: all(len(line.read()) > at + 20 for line, at in zip(self.ptys, before, strict=True))
        )
        for line, at in zip(self.ptys, before, strict=True):
            assert set(line.read()[at:]) == set(b"safe!")


@pytest.fixture
def rig() -> Iterator[Any]:
    with ptys(2) as lines:
        made: list[Rig] = []

        def make(**given: Any) -> Rig:
            made.append(Rig(lines, **given))
            assert made[0].guardian.open()
            return made[0]

        yield make
        for each in made:
            for process in each.started:
                process.kill()
                process.wait()
            each.guardian._finish()


def test_ports_have_the_initial_frame_then_each_its_own_commands(rig: Any) -> None:
    made = rig()
    made.until_wire(b"first", b"first")
    made.boxes[1].put(b"other")
    made.until_wire(b"first", b"other")
    assert made.alarms() == []


def kill(made: Rig) -> None:
    made.application.kill()


def end_thread(made: Rig) -> None:
    made.control[control.START] = time.monotonic_ns() + 10**15
    made.loop_ends.set()


def order(made: Rig) -> None:
    made.link.send(Order.SAFE)


def end(made: Rig) -> None:
    made.control[control.END] = 1


def leave(made: Rig) -> None:
    made.control[control.LEFT] = 1


def lose_host(made: Rig) -> None:
    made.supervisor.kill()


@pytest.mark.parametrize("first", [order, end, leave, lose_host])
def test_no_end_keeps_a_guardian_awake_that_is_safe_already(rig: Any, first: Any) -> None:
    made = rig()
    made.follow()
    made.control[control.START] = time.monotonic_ns() + 10**15  # so that the lifeline of the loop is watched
    made.guardian.look()
    first(made)
    made.until(lambda: made.guardian.safe)
    made.loop_ends.set()
    made.host_ends.set()
    made.supervisor.kill()
    made.application.kill()
    awake = made.guardian._sources
    wait_for(lambda: len(select.select(awake, [], [], 0)[0]) >= 3)
    made.guardian.look()
    assert select.select(made.guardian._sources, [], [], 0)[0] == []


@pytest.mark.parametrize("cause", [kill, end_thread, order, end, leave, lose_host])
def test_every_end_makes_all_ports_safe_for_ever(rig: Any, cause: Any) -> None:
    made = rig()
    made.follow()
    cause(made)
    made.stays_safe()
    assert made.alarms() == []  # the supervisor knows


def test_the_end_of_a_process_that_others_can_do_without_changes_nothing(rig: Any) -> None:
    made = rig()
    made.follow()
    other = made.process()
    made.link.send(Watch(other.pid, vital=False))
    made.guardian.look()
    other.kill()
    other.wait()
    made.guardian.look()
    for box in made.boxes:
        box.put(b"again")
    made.until_wire(b"again", b"again")
    assert not made.guardian.safe
    made.application.kill()
    made.stays_safe()


def hang(made: Rig) -> None:
    made.control[control.START] = time.monotonic_ns() - 60 * MS
    made.control[control.BEGUN] = 1 * MS


def test_a_step_that_hangs_makes_all_ports_safe_and_raises_an_alarm(rig: Any) -> None:
    made = rig()
    made.follow()
    hang(made)
    made.stays_safe()
    made.control[control.BEGUN] = 0
    made.control[control.DONE] = 7
    made.stays_safe()
    assert made.alarms() == [Alarm("the loop has given no sign of life for 0.05 s")]


def test_where_overruns_only_warn_a_loop_that_goes_on_is_followed_again(rig: Any) -> None:
    made = rig(lasting=False)
    made.follow()
    hang(made)
    made.until_wire(b"safe!", b"safe!")
    made.control[control.START] = time.monotonic_ns() + 10**15  # the loop is well from now on
    made.control[control.BEGUN] = 0
    for box in made.boxes:
        box.put(b"again")
    made.until_wire(b"again", b"again")
    assert made.alarms() == []


@pytest.mark.parametrize("word", [CONTINUE, STOP, SAFE])
def test_the_death_of_the_host_means_what_the_diagram_says(rig: Any, word: str) -> None:
    made = rig(on_host_loss=word)
    made.follow()
    made.supervisor.kill()
    made.until(lambda: made.guardian._supervisor.any_ended)
    made.guardian.look()
    assert made.guardian.safe == (word == SAFE)
    made.application.kill()
    made.stays_safe()


@pytest.mark.parametrize("word", [CONTINUE, STOP, SAFE])
def test_it_is_noticed_while_the_process_of_the_host_still_gives_its_memory_back(rig: Any, word: str) -> None:
    made = rig(on_host_loss=word)
    made.follow()
    made.host_ends.set()
    made.until(made.guardian._vigil.has_ended)
    made.guardian.look()
    assert made.guardian.safe == (word == SAFE)
    assert made.supervisor.poll() is None
    made.application.kill()
    made.stays_safe()


def test_a_port_that_is_unplugged_makes_the_others_safe_and_is_reported(rig: Any) -> None:
    made = rig()
    made.follow()
    made.ptys[0].unplug()
    made.until(lambda: made.ptys[1].read().endswith(2 * b"safe!"))
    (alarm,) = made.alarms()
    assert alarm.block == "out0"
    assert alarm.reason == f"{made.ptys[0].path}: the port is gone: input/output error"


def test_a_port_that_is_missing_makes_those_safe_that_could_be_opened() -> None:
    with ptys(1) as (line,):
        missing = Pty()
        missing.close()
        made = Rig([missing, line])
        assert not made.guardian.open()
        made.until(lambda: line.read().endswith(2 * b"safe!"))
        (alarm,) = made.alarms()
        assert (alarm.block, "is missing" in alarm.reason) == ("out0", True)
        made.supervisor.kill()
        made.supervisor.wait()


@dataclass
class Relays(Card):
    """A card of two relays, of which one may refuse."""

    written: list[tuple[int, int]]
    refused: list[int]

    def open(self, port: str) -> OpenPort:
        """Open it."""
        made = OpenRelays()
        made.card = self
        return made


class OpenRelays(OpenPort):
    """The card, open."""

    card: Relays

    def write(self, piece: bytes) -> int:
        """Write to each relay that takes it."""
        for relay, value in enumerate(piece):
            if relay not in self.card.refused:
                self.card.written.append((relay, value))
        if self.card.refused:
            raise ChannelError(f"relay {self.card.refused[0]} refuses")
        return len(piece)

    def close(self) -> None:
        """End."""
        self.card.written.append((-1, 0))


def test_a_channel_that_fails_keeps_no_other_from_its_safe_value(rig: Any) -> None:
    made, card = rig(), Relays([], [])
    port = OutputPort("relays", "card", card, 5 * MS, b"\1\2", b"\3\4")
    made.guardian._outlets.append(Outlet(port, lambda: b"\5\6"))
    made.guardian._outlets[-1].open()
    made.until(lambda: card.written[-2:] == [(0, 5), (1, 6)])
    card.refused.append(0)
    made.until(lambda: card.written[-2:] == [(1, 4)] * 2)
    assert made.alarms() == [Alarm("card: relay 0 refuses", "relays")]
    made.until_wire(b"safe!", b"safe!")
    card.refused.clear()
    made.until(lambda: card.written[-2:] == [(0, 3), (1, 4)])
    made.link.send(Order.CLOSE)
    made.supervisor.kill()
    made.guardian.run()
    assert card.written[-3:] == [(0, 3), (1, 4), (-1, 0)]
    assert made.alarms() == []


class Failing(OpenRelays):
    """The card of a driver that fails in its own way, first as it is written to, and then as it is closed."""

    def write(self, piece: bytes) -> int:
        raise RuntimeError("the driver is confused")

    def close(self) -> None:
        raise RuntimeError("the driver is confused")


def test_a_driver_that_fails_in_its_own_way_keeps_no_other_port_from_its_safe_frames(rig: Any) -> None:
    made = rig()
    port = OutputPort("relays", "card", Relays([], []), 5 * MS, b"\1\2", b"\3\4")
    made.guardian._outlets.insert(0, Outlet(port, lambda: b"\5\6", lambda: Failing()))
    made.guardian._outlets[0].open()
    made.until_wire(b"safe!", b"safe!")
    why = "card: the driver has failed: RuntimeError: the driver is confused"
    assert made.alarms() == [Alarm(why, "relays")]


def test_a_device_that_still_starts_has_its_safe_frames_before_its_port_is_closed(monkeypatch: Any) -> None:
    now = NANOSECONDS
    monkeypatch.setattr("quadvis.realtime.guardian.time", SimpleNamespace(monotonic_ns=lambda: now))
    with ptys(1) as (line,):
        port = OutputPort("board", line.path, Line(10**6, settle=2.0), 5 * MS, b"first", b"safe!")
        words = np.zeros(words_for(1), np.int64)
        host_ends = threading.Event()
        Rig.live(supervisor_lifeline(words), host_ends)
        link, theirs = Pipe()
        guardian = Guardian(GuardianSetup((port,), words, (), theirs, os.getpid(), SAFE, Standing()))
        assert guardian.open()
        link.send(Order.CLOSE)
        guardian.look()
        now += LAST + MS
        guardian.look()
        assert (guardian._finished, line.read()) == (False, b"")
        for _ in range(3):
            now += LAST
            guardian.look()
        assert (guardian._finished, line.read()) == (True, 3 * b"safe!")
        guardian._finish()
        host_ends.set()


def test_it_closes_the_ports_when_everything_else_has_ended(rig: Any) -> None:
    made = rig()
    made.follow()
    made.link.send(Order.CLOSE)
    made.guardian.run()
    assert all(line.read().endswith(3 * b"safe!") for line in made.ptys)
    for line in made.ptys:
        os.close(os.open(line.path, os.O_RDWR | os.O_NOCTTY))


def test_it_ends_by_itself_when_nobody_lives_whom_it_works_for(rig: Any) -> None:
    made = rig(on_host_loss=CONTINUE)
    made.follow()
    for process in made.started:
        process.kill()
    made.guardian.run()
    assert all(line.read().endswith(3 * b"safe!") for line in made.ptys)


def test_asked_to_end_it_stays_until_its_applications_have_ended(rig: Any) -> None:
    made = rig()
    made.follow()
    made.guardian.told_to_end = True
    made.stays_safe()
    assert made.alarms() == [Alarm("the guardian was told to end")]
    assert not made.guardian._finished
    made.application.kill()
    made.guardian.run()


def test_it_stands_above_all_loops_and_beside_their_processors() -> None:
    loops = [RealTime(cpu=1, priority=80), RealTime(priority=85), RealTime(cpu=3, priority=0)]
    assert Standing.to(loops) == Standing(86, frozenset({1, 3}))
    assert Standing.to([RealTime(priority=99)]).priority == 99
    assert Standing.to([RealTime(priority=0)]) == Standing()
