"""A port of several devices: frames one after another, with one sealer; news once; a reader of the same."""

from __future__ import annotations

import os
import select
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing import Pipe
from typing import Any

import numpy as np
import pytest

from quadvis.block.output import LONGEST
from quadvis.machine.datagrams import Datagrams
from quadvis.machine.mailbox import Mailbox
from quadvis.machine.ports import PortError
from quadvis.machine.serial_port import Line, open_port
from quadvis.realtime.news import NewsOutlet, news_of
from quadvis.realtime.outlet import Outlet, OutputPort
from quadvis.realtime.reports import MOST, Reports
from quadvis.realtime.shared_ports import ROOM, SharedPort, SharedPorts, lent_port
from tests.quadvis.realtime.ptys import Pty, ptys

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="ports are Linux's")

MS = 10**6
BEGIN = 10**9
LINE = Line(10**6)


@dataclass
class Counting:
    """Puts a number before each frame, and "beat" behind every fifth."""

    added: int = 5
    sent: int = 0

    def seal(self, frame: bytes, now_ns: int) -> bytes:
        beat = b""
        if now_ns - self.sent_at >= 100 * MS:
            self.sent_at, beat = now_ns, b"beat "
        if frame:
            self.sent += 1
        return (b"%d%s " % (self.sent, frame) if frame else b"") + beat

    sent_at: int = BEGIN


class Rig:
    """Two outlets that repeat commands, and one for news, at one pty."""

    def __init__(self, pty: Pty) -> None:
        self.pty = pty
        shared = SharedPorts()
        self.commands: dict[str, bytes] = {}
        self.box = Mailbox(np.zeros(Mailbox.size(LONGEST, 3), np.int64), LONGEST, 3)
        self.outlets: list[Outlet] = []
        for name, interval in (("a", 10), ("b", 20)):
            port = OutputPort(
                name,
                pty.path,
                LINE,
                interval * MS,
                name.encode(),
                name.upper().encode(),
                Counting(),
                shared=True,
            )
            taken, opens = shared.taken(port)
            self.outlets.append(Outlet(taken, lambda name=name: self.commands.get(name), opens))
        news = OutputPort("n", pty.path, LINE, 10 * MS, b"", b"", Counting(), news=True, shared=True)
        taken, opens = shared.taken(news)
        self.outlets.append(NewsOutlet(taken, news_of(self.box), opens))
        for outlet in self.outlets:
            outlet.open()
        self.shared = shared

    def serve(self, instant: float, *, safe: bool = False) -> bytes:
        before = len(self.pty.read())
        for outlet in self.outlets:
            outlet.serve(BEGIN + int(instant * MS), safe=safe)
        return self.pty.read()[before:]


@pytest.fixture
def rig() -> Iterator[Rig]:
    with ptys(1) as (pty,):
        made = Rig(pty)
        yield made
        for outlet in made.outlets:
            outlet.close()


def test_each_outlet_has_its_rate_and_all_have_one_sealer(rig: Rig) -> None:
    assert [rig.serve(at) for at in (0, 10, 20)] == [b"1a 2b ", b"3a ", b"4a 5b "]
    assert rig.serve(30, safe=True) == b"6A "


def test_news_come_once_and_nothing_at_the_end(rig: Rig) -> None:
    rig.serve(0)
    rig.box.put(b"pose", 1)
    assert [rig.serve(at) for at in (10, 20)] == [b"3a 4pose ", b"5a 6b "]
    rig.box.put(b"pose", 2)
    rig.box.put(b"later", 3)
    assert rig.serve(30) == b"7a 8later "
    rig.box.put(b"too late", 4)
    assert rig.serve(40, safe=True) == b"9A 10B "


def test_a_sealer_sends_by_itself_where_there_are_only_news(rig: Rig) -> None:
    news = rig.outlets[2]
    for at in range(0, 200, 10):
        news.serve(BEGIN + at * MS, safe=False)
    assert rig.pty.read() == b"beat "


def test_long_silence_is_no_stuck_port(rig: Rig) -> None:
    news = rig.outlets[2]
    for at in range(0, 5000, 500):
        news.serve(BEGIN + at * MS, safe=at == 3000)
    rig.box.put(b"late", 1)
    news.serve(BEGIN + 5000 * MS, safe=False)
    assert rig.pty.read().endswith(b"1late beat ")


def test_frames_are_never_put_into_each_other(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    random = np.random.default_rng(4)
    monkeypatch.setattr(
        "quadvis.machine.serial_port.write_some",
        lambda descriptor, piece: os.write(descriptor, piece[: int(random.integers(0, 4))]),
    )
    for at in range(0, 2000, 10):
        rig.commands = {"a": b"alpha" * 8, "b": b"beta" * 8}
        rig.serve(at)
    frames = rig.pty.read().replace(b"beat ", b"").split(b" ")[:-1]
    numbers = [int("".join(chr(byte) for byte in frame if chr(byte).isdigit())) for frame in frames]
    assert numbers == list(range(1, len(numbers) + 1))
    kinds = {bytes(byte for byte in frame if not chr(byte).isdigit()) for frame in frames}
    assert kinds <= {b"a", b"b", b"alpha" * 8, b"beta" * 8} and len(numbers) > 10


def test_a_line_with_too_much_before_it_leaves_a_frame_out_and_a_stuck_one_is_lost(
    rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.commands = {"a": b"a" * ROOM, "b": b"b"}
    rig.serve(0)
    monkeypatch.setattr("quadvis.machine.serial_port.write_some", lambda *_: 0)
    rig.serve(10)  # waits in our hands
    assert rig.serve(20) == b""
    with pytest.raises(PortError, match="the port takes no bytes"):
        for at in range(30, 3000, 10):
            rig.serve(at)


def test_the_port_is_closed_when_its_last_outlet_is(rig: Rig) -> None:
    rig.outlets[0].close()
    with pytest.raises(PortError, match="is in use by another program"):
        open_port(rig.pty.path, LINE)
    assert rig.serve(0) == b"1b "
    rig.outlets[1].close()
    rig.outlets[2].close()
    os.close(open_port(rig.pty.path, LINE))


def test_a_reader_gets_what_comes_to_a_line_that_nobody_else_may_open(rig: Rig) -> None:
    ours, theirs = Pipe()
    rig.shared.lend({rig.pty.path: ours})
    lent = lent_port(LINE, theirs)
    os.write(rig.pty.peer, b"hello")
    assert select.select([lent.fileno()], [], [], 10)[0]  # type: ignore[attr-defined]
    assert lent.read_waiting().pieces == (b"hello",)
    lent.close()
    with pytest.raises(PortError, match="is in use by another program"):
        open_port(rig.pty.path, LINE)
    assert rig.serve(0) == b"1a 2b "


def datagrams(port: str) -> tuple[SharedPort, Any]:
    shared, (ours, theirs) = SharedPorts(), Pipe()
    output = OutputPort("out", port, Datagrams(True), MS, b"first", b"safe", shared=True)
    taken, opens = shared.taken(output)
    assert opens is not None
    opened = opens()
    assert isinstance(opened, SharedPort)
    shared.lend({port: ours})
    return opened, lent_port(taken.settings, theirs)


def test_answers_to_datagrams_come_to_the_reader() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.bind(("127.0.0.1", 0))
        peer.settimeout(10)
        opened, lent = datagrams(f"udp:127.0.0.1:{peer.getsockname()[1]}")
        opened.write(b"question")
        data, address = peer.recvfrom(100)
        peer.sendto(b"answer", address)
        assert select.select([lent.fileno()], [], [], 10)[0]
        assert (data, lent.read_waiting().pieces) == (b"question", (b"answer",))
        lent.close()
        opened.close()


def test_the_first_who_speaks_is_answered_though_another_process_reads() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    opened, lent = datagrams(f"udp::{port}")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        peer.settimeout(10)
        assert opened.write(b"nobody") == 6
        peer.sendto(b"hello", ("127.0.0.1", port))
        assert select.select([lent.fileno()], [], [], 10)[0]
        assert lent.read_waiting().pieces == (b"hello",)
        opened.write(b"you")
        assert peer.recv(100) == b"you"
    lent.close()
    opened.close()


def test_reports_have_their_time_and_are_not_endless() -> None:
    class Clock:
        def now(self) -> int:
            return 1500 * MS

    ours, theirs = Pipe()
    reports = Reports(theirs, Clock())
    for number in range(MOST + 10):
        reports.take(f"number {number}")
    found = []
    while ours.poll():
        found.append(ours.recv())
    assert found[0] == "t = 1.500 s: number 0" and len(found) == MOST
