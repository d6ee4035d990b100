"""The porter ends, however it ends: the target goes on, and hosts are served by the next one."""

from __future__ import annotations

import os
import signal
import socket
import struct
import subprocess
import sys
from contextlib import suppress
from itertools import pairwise
from pathlib import Path

import pytest

from quadvis.wire import porter as porters
from quadvis.wire.address import WireAddress
from quadvis.wire.client import Client
from quadvis.wire.courier import CONNECTED
from quadvis.wire.porter import Porter
from quadvis.wire.refusals import GoneError, NoAnswerError
from quadvis.wire.server import Server
from tests.processes import gone
from tests.quadvis.wire.rig import Echo, Rig, after_loss, until
from tests.stages import mostly_slow

ENDS = [signal.SIGABRT, signal.SIGKILL]


def end_porter(rig: Rig, how: signal.Signals = signal.SIGKILL) -> int:
    """End the porter; return its process."""
    pid = int(until(lambda: rig.server.porter.pid))
    os.kill(pid, how)
    return pid


@pytest.mark.faults
@pytest.mark.parametrize("how", mostly_slow(ENDS))
def test_hosts_are_served_again_when_the_porter_has_ended(
    how: signal.Signals, rig: Rig, monkeypatch: pytest.MonkeyPatch
) -> None:
    rig.key("anna", 0)
    rig.server.lease.lasts = 60.0  # the machine may be busy
    monkeypatch.setattr("quadvis.wire.client.LEASE", 60.0)
    anna = rig.client()
    scope = anna.subscribe("scope/1")
    anna.operate()
    rig.server.publish("scope/1", {})
    assert scope.take(20).number == 1
    first = end_porter(rig, how)
    until(lambda: rig.server.counts["porters lost"] == 1 and anna._courier.state() != CONNECTED)
    rig.server.publish("scope/1", {})  # nobody hears it, and nothing waits
    # By the same client, with the same lease.
    after_loss(lambda: anna.request("setparam", 20, values={"a": 1.0}))
    assert rig.echo.values == {"a": 1.0} and anna.operates and rig.lost == []
    until(lambda: rig.server.wants("scope/1"))  # the host has asked again by itself
    rig.server.publish("scope/1", {})
    assert (scope.take(20).number, scope.missed) == (3, 1)
    assert rig.server.porter.pid not in (0, first)
    words = f"has ended by {how.name}; all hosts have lost their connections, and a new porter starts "
    assert any(words in said for said in rig.said) and words in rig.audit.read_text()


@pytest.mark.faults
def test_the_lease_is_lost_if_the_porter_is_away_for_long(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(porters, "_FIRST", 1e6)
    rig.key("anna", 0)
    anna = rig.client()
    anna.operate()
    end_porter(rig)
    until(lambda: rig.lost)  # as when the host is lost; the target goes on by itself
    assert rig.lost[0].name == "anna" and rig.server.lease.operator is None
    with pytest.raises((NoAnswerError, GoneError)):
        anna.request("setparam", 0.1, values={"a": 1.0})
    rig.server.porter._due = 0.0
    assert after_loss(lambda: anna.request("status", 20))["operator"] is None
    until(lambda: not anna.operates)
    with pytest.raises(GoneError):
        anna.request("setparam", 20, values={"a": 1.0})
    anna.operate()
    anna.request("setparam", 20, values={"a": 2.0})
    assert rig.echo.values == {"a": 2.0}


GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x01" + b"NULL".ljust(20, b"\0") + bytes(32)
READY = b"\x05READY\x0bSocket-Type" + struct.pack(">I", 6) + b"DEALER"
MEMORY, ENDLESS = 24 << 20, 1 << 30  # bytes
FRAME = b"\x03" + struct.pack(">Q", 1 << 18) + bytes(1 << 18)  # one of which another one follows


def frames_without_end(port: int) -> int:
    """Send one message, frame by frame, until nobody takes it any more; return the bytes that were taken."""
    taken = 0
    with suppress(OSError), socket.create_connection(("127.0.0.1", port)) as peer:
        peer.sendall(GREETING + b"\x04" + bytes([len(READY)]) + READY)
        answer = b""
        while b"READY" not in answer:  # a host that is let in
            answer += peer.recv(1000)
        while taken < ENDLESS:
            peer.sendall(FRAME)
            taken += len(FRAME)
    return taken


@pytest.mark.faults
def test_a_message_of_frames_without_end_takes_no_more_memory_than_the_porter_may_have() -> None:
    """libzmq cuts the peer off when it gets no more memory, or ends, and with it the porter alone."""
    with Server("lab1", Echo(), memory=MEMORY) as server:
        port = server.listen("127.0.0.1", 0, insecure=True)
        server.start()
        for _ in range(3):
            assert frames_without_end(port) < ENDLESS
        with Client(WireAddress("127.0.0.1", port), "lab1", None, b"") as good:
            assert good.connect(20)["target"] == "lab1"
        status = Path(f"/proc/{server.porter.pid}/limits").read_text()
        assert int(status.partition("Max data size")[2].split()[0]) < MEMORY + (64 << 20)


@pytest.mark.slow
def test_a_porter_that_hangs_is_ended(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(porters, "PORTER_SILENT", 1.0)
    rig.key("anna", 0)
    anna = rig.client()
    end_porter(rig, signal.SIGSTOP)
    with pytest.raises(NoAnswerError, match="the connection to lab1 is lost"):
        anna.request("status", 60)
    assert anna.request("status", 60)["Status"] == "stopped"
    assert any("as it gave no sign of life for 1 s" in said for said in rig.said)


@pytest.mark.slow
def test_a_porter_ends_with_its_target_however_that_ends() -> None:
    script = (
        "from quadvis.wire.server import Server\n"
        "server = Server('lab1', lambda *_: None)\n"
        "server.listen('127.0.0.1', 0, insecure=True)\n"
        "server.start()\n"
        "while not server.porter.pid or not server.porter.connected: pass\n"
        "print(server.porter.pid, flush=True); input()"
    )
    words = [sys.executable, "-c", script]
    with subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as target:
        assert target.stdout is not None
        porter = int(target.stdout.readline())
        assert not gone(porter)
        target.kill()
        until(lambda: gone(porter))


def test_porters_that_end_at_once_are_started_ever_more_seldom(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(descriptors: object) -> None:
        raise OSError(11, "Resource temporarily unavailable")

    now = 1000.0
    said: list[str] = []
    monkeypatch.setattr(porters, "_begun", never)
    porter = Porter([], None, said.append, clock=lambda: now)
    starts = []
    for _ in range(12):
        porter.watch()
        starts.append(now)
        assert porter.watch() > 0  # until it is time, nothing happens
        now += porter.watch()
    assert len(said) == len(starts) == 12
    pauses = [later - earlier for earlier, later in pairwise(starts)]
    assert pauses == pytest.approx([0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 5, 5, 5, 5, 5])
    assert said[1].startswith("the porter cannot be started (Resource temporarily unavailable); ")
    assert said[1].endswith("and a new porter starts in 0.2 s")


def test_nothing_is_sent_to_a_connection_of_an_earlier_porter(rig: Rig) -> None:
    """Another host may have its identity now."""
    rig.key("anna", 0)
    rig.client().request("status")
    porter = rig.server.porter
    earlier = porter.key(0, b"\0abcd")
    assert porter.send([earlier], [b"x"])
    end_porter(rig)
    until(lambda: rig.server.counts["porters lost"] == 1 and porter.pid)
    assert porter.key(0, b"\0abcd") != earlier
    assert not porter.send([earlier], [b"x"])


def test_the_porter_imports_little() -> None:
    """It must be there soon, also when it is started again."""
    script = (
        "import sys, quadvis.wire.porter_process\n"
        "print(sorted({'numpy', 'yaml', 'asyncio', 'subprocess', 'quadvis.errors'} & sys.modules.keys()))"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"
