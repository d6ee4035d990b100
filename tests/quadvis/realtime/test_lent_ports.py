"""An input that has the port of an output reads what comes back there, over a line and by datagrams."""

from __future__ import annotations

import os
import select
import socket
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

import quadvis
from quadvis.errors import DiagramError
from tests.quadvis.realtime.ptys import ptys

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

TEXT = """\
quadvis: 1
name: both ways
rates: {fast: 50 Hz, slow: 10 Hz}
overload: {action: warn}
stop_time: 1 s
computers: {sender: {}, hearer: {}}
blocks:
  stick: {block: sources.constant, rate: fast, at: sender, with: {value: [0.25]}}
  out:
    block: hardware.sbus_out
    rate: fast
    at: sender
    with: {port: "PORT", channels: [1], lowest: [0], highest: [1], initial: [0.5], safe: [0]}
    in: {command: stick.y}
  back:
    block: hardware.sbus_in
    rate: slow
    at: hearer
    with: {port: "BACK", channels: [1], lowest: [0], highest: [1], roles: throttle}
"""


def write(port: str, back: str = "") -> None:
    text = TEXT.replace("PORT", port).replace("BACK", back or port)
    Path("flight.yaml").write_text(text)


@contextmanager
def answering(answer: Callable[[], None]) -> Iterator[None]:
    """Let a peer answer again and again."""
    done = threading.Event()

    def work() -> None:
        while not done.is_set():
            answer()

    thread = threading.Thread(target=work)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def fly() -> None:
    """Run, and find that the frames of the output have come back to the other computer."""
    diagram = quadvis.load("flight.yaml")
    result = diagram.run(real_time=quadvis.RealTime(priority=0, poll="0 s"))
    assert result["back.command"][-1, 0] == pytest.approx(0.25, abs=1e-3)
    assert result["back.refused"][-1] == 0
    assert result["back.age"][-1] < 0.5


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.slow
def test_what_comes_back_over_a_serial_line_is_read(tmp_path: Path) -> None:
    with ptys(1) as (pty,):
        write(pty.path)

        def answer() -> None:
            if select.select([pty.peer], [], [], 0.05)[0]:
                os.write(pty.peer, os.read(pty.peer, 1000))

        with answering(answer):
            fly()


@pytest.mark.slow
def test_a_peer_that_speaks_first_is_answered_and_heard() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as peer:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
            free.bind(("127.0.0.1", 0))
            place = free.getsockname()
        peer.settimeout(0.05)

        def answer() -> None:
            try:
                peer.sendto(2 * peer.recv(100), place)  # a reader of SBUS begins where two frames meet
            except TimeoutError:
                peer.sendto(b"hello", place)

        write(f"udp::{place[1]}")
        with answering(answer):
            fly()


def test_the_two_have_one_name_and_one_setting() -> None:
    os.symlink("/dev/null", "line")
    for port, back, words in (
        ("/dev/null", "line", "is that of block 'out'; write '/dev/null' in both, if one is to read"),
        (
            "udp::9",
            "udp:127.0.0.1:9",
            "port 'udp:127.0.0.1:9' is that of block 'out'; write 'udp::9' in both",
        ),
    ):
        write(port, back)
        with pytest.raises(DiagramError) as caught:
            quadvis.load("flight.yaml")
        assert words in str(caught.value)
    for port, back in (("udp:127.0.0.1:9", "udp::9"), ("udp:craft:9", "udp:craft:9")):
        write(port, back)
        quadvis.load("flight.yaml")
