"""Strangers, forged bytes, floods, slow hosts: refused and counted, and a good host is served meanwhile."""

from __future__ import annotations

import os
import random
import socket
import struct
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Any

import pytest
import zmq

from quadvis.wire.client import Client
from quadvis.wire.keys import KeyPair, made_pair, new_key
from quadvis.wire.limits import CONNECTIONS, HALF_OPEN, HANDSHAKE, REQUEST
from quadvis.wire.meeting import meet
from quadvis.wire.messages import read_reply
from quadvis.wire.refusals import WireError
from tests.processes import children
from tests.quadvis.wire.rig import Rig, proxied, request, until
from tests.quadvis.wire.target_process import PACKAGES
from tests.stages import mostly_slow

ENOUGH = 5.0  # MB by which attacks may let a target grow


@pytest.mark.faults
def test_a_stranger_is_turned_away_before_a_message(rig: Rig) -> None:
    with rig.raw(made_pair("eve")) as eve:
        eve.send(request("status"))
        until(lambda: rig.server.counts["turned away"] >= 1)
        assert not eve.poll(50)
    assert rig.echo.calls == [] and rig.server.counts["messages"] == 0


@pytest.mark.faults
def test_whoever_has_no_key_or_takes_the_target_for_another_one_is_not_heard(rig: Rig) -> None:
    pair = rig.key("anna", 0)
    for key, server in ((None, None), (pair, made_pair("x").public)):
        with rig.raw(key, server=server) as eve:
            eve.send(request("status"))
            assert not eve.poll(300)
    assert rig.server.counts["messages"] == 0 and rig.server.counts["let in"] == 0


def captured(rig: Rig, pair: KeyPair) -> bytes:
    """Return all bytes that a host has sent, from its greeting to a command that was done."""
    with proxied(rig.port) as proxy, rig.raw(pair, proxy.port) as anna:
        for number, (verb, args) in enumerate((("lease", {}), ("setparam", {"values": {"a": 1.0}}))):
            anna.send(request(verb, number, **args))
            assert read_reply(anna.recv()).error is None
        return bytes(proxy.sent)


@pytest.mark.faults
def test_a_session_that_is_sent_again_does_nothing(rig: Rig) -> None:
    sent = captured(rig, rig.key("anna", 0))
    heard = list(rig.echo.calls)
    assert heard == [("setparam", "anna")] and len(sent) > 500
    for start in (0, 64):
        with socket.create_connection(("127.0.0.1", rig.port)) as again:
            again.settimeout(20)
            with suppress(OSError):
                again.sendall(sent[start:])
                while again.recv(4096):
                    pass
    assert rig.echo.calls == heard and rig.server.counts["messages"] == 2


@pytest.mark.parametrize("seed", mostly_slow(range(40), 3))
def test_a_bit_that_is_flipped_on_the_way_changes_no_command(seed: int, rig: Rig) -> None:
    """Wherever it falls, in the handshake or later: a command arrives as it was sent, or not at all."""
    pair = rig.key("anna", 0)
    at = random.Random(seed).randrange(900)

    def flip(count: int, data: bytes) -> bytes:
        changed = bytearray(data)
        if count <= at < count + len(data):
            changed[at - count] ^= 1 << seed % 8
        return bytes(changed)

    with proxied(rig.port, change=flip) as proxy, rig.raw(pair, proxy.port) as anna:
        anna.rcvtimeo = 300
        for number in range(12):
            verb, args = ("setparam", {"values": {"a": 1.5}}) if number else ("lease", {})
            with suppress(zmq.Again):
                anna.send(request(verb, number, **args), zmq.NOBLOCK)
                anna.recv()
    assert rig.echo.values in ({}, {"a": 1.5}) and rig.server.counts["malformed"] == 0


GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x01" + b"CURVE".ljust(20, b"\0") + bytes(32)
RAW = {
    "random": random.Random(1).randbytes(5000),
    "a page, please": b"GET / HTTP/1.1\r\nHost: lab1\r\n\r\n",
    "a greeting alone": GREETING,
    "a plain greeting": GREETING.replace(b"CURVE", b"NULL\0"),
    "a command of 2^63 bytes": GREETING + b"\x06" + struct.pack(">Q", 2**63 - 1),
    "a command of 2^40 bytes": GREETING + b"\x06" + struct.pack(">Q", 2**40) + bytes(10_000),
    "a message before the handshake": GREETING + b"\x00\x05hello",
    "a handshake of zeros": GREETING + b"\x04\xc8\x05HELLO" + bytes(194),
    "a short handshake": GREETING + b"\x04\x06\x05HELLO",
    "an old version": b"\xff" + bytes(8) + b"\x7f\x01",
}


@pytest.mark.faults
@pytest.mark.parametrize("name", RAW)
def test_odd_bytes_are_no_message_and_a_good_host_is_served(name: str, rig: Rig) -> None:
    rig.key("anna", 0)
    anna = rig.client()
    with ExitStack() as open_connections:
        for port in (rig.port, rig.port + 1, rig.port + 2):
            for _ in range(5):
                connection = open_connections.enter_context(socket.create_connection(("127.0.0.1", port)))
                with suppress(OSError):
                    connection.sendall(RAW[name])
        for _ in range(20):
            assert anna.request("status", 20)["Status"] == "stopped"
    assert {name for _, name in rig.echo.calls} == {"anna"}


@pytest.mark.faults
def test_connections_that_show_no_key_are_bounded_and_cost_nobody_a_connection(rig: Rig) -> None:
    rig.key("anna", 0)
    rig.key("bob", 0)
    anna = rig.client()
    state = anna.subscribe("state")
    time.sleep(HANDSHAKE)  # anna's connection is one of the old ones now, which are never shut
    with ExitStack() as open_connections:
        for _ in range(3 * HALF_OPEN):
            connection = open_connections.enter_context(socket.create_connection(("127.0.0.1", rig.port)))
            connection.sendall(GREETING[:12])
        until(
            lambda: anna.request("status", 20)["wire"]["shut"] >= 3 * HALF_OPEN + 1 - HALF_OPEN - CONNECTIONS
        )
        assert rig.server.counts["let in"] == 2, "anna had to connect again"
    assert rig.client("bob").request("hello")["key"] == "bob"
    rig.server.publish("state", {})
    assert state.take(20).number == 1


def test_who_is_silent_is_not_even_accepted(rig: Rig) -> None:
    rig.key("anna", 0)
    anna = rig.client()
    with ExitStack() as open_connections:
        for _ in range(CONNECTIONS):
            open_connections.enter_context(socket.create_connection(("127.0.0.1", rig.port)))
        assert anna.request("status", 20)["wire"]["connections"][0] == 1


@pytest.mark.faults
@pytest.mark.slow
def test_bytes_that_drip_are_cut_off(rig: Rig) -> None:
    rig.key("anna", 0)
    anna = rig.client()
    with socket.create_connection(("127.0.0.1", rig.port)) as drip:
        drip.settimeout(0.1)
        ended = False
        for number in range(300):
            try:
                drip.sendall(GREETING[number % 64 : number % 64 + 1])
                ended = drip.recv(1000) == b"" and number > 0
            except TimeoutError:
                pass
            except OSError:
                ended = True
            if ended:
                break
        assert ended and anna.request("status", 20)["Status"] == "stopped"


class TargetProcess:
    """A target in a process of its own, whose memory can be looked at. See `target_process`."""

    def __init__(self, folder: Path) -> None:
        self.host = folder / "host"
        self.host.mkdir(mode=0o700)
        self.pairs = {f"host{level}": new_key(f"host{level}", self.host)[0] for level in range(5)}
        keys = [pair.public.hex() for pair in self.pairs.values()]
        words = [sys.executable, "-m", "tests.quadvis.wire.target_process", str(folder / "target"), *keys]
        self.process = subprocess.Popen(words, stdout=subprocess.PIPE, stdin=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        port, public = self.process.stdout.readline().split()
        self.port, self.public = int(port), bytes.fromhex(public)

    def client(self, level: int = 0) -> Client:
        return meet(f"127.0.0.1:{self.port}", key=f"host{level}", folder=self.host, timeout=60)

    def raw(self, level: int, port: int | None = None) -> zmq.Socket[Any]:
        made = zmq.Context.instance().socket(zmq.DEALER)
        made.linger, made.rcvhwm, made.sndhwm, made.rcvbuf = 0, 1, 10, 4096
        pair = self.pairs[f"host{level}"]
        made.curve_publickey, made.curve_secretkey, made.curve_serverkey = (
            pair.public,
            pair.private,
            self.public,
        )
        made.connect(f"tcp://127.0.0.1:{port or self.port}")
        return made

    def memory(self) -> float:
        """Return the resident memory of the target and its porter (MB)."""
        (porter,) = children(self.process, b"porter_process")
        texts = [
            Path(f"/proc/{each}/statm").read_text(encoding="ascii") for each in (self.process.pid, porter)
        ]
        return sum(int(text.split()[1]) for text in texts) * os.sysconf("SC_PAGESIZE") / 1e6

    def close(self) -> None:
        assert self.process.stdin is not None and self.process.stdout is not None
        self.process.stdin.close()
        self.process.stdout.close()
        assert self.process.wait(60) == 0


@pytest.fixture
def target(tmp_path: Path) -> Iterator[TargetProcess]:
    made = TargetProcess(tmp_path)
    try:
        yield made
    finally:
        made.close()


def served(client: Client, times: int = 30) -> None:
    """Ask again and again: each answer must come, in order, while others attack."""
    for _ in range(times):
        assert client.request("status", 20)["Status"] == "stopped"
        time.sleep(0.02)


def grown(target: TargetProcess, client: Client, attack: Any) -> float:
    """Return by how much (MB) a target has grown while it was attacked, after a first attack."""
    stop = threading.Event()
    thread = threading.Thread(target=attack, args=(stop,), daemon=True)
    thread.start()
    served(client)
    before = target.memory()
    served(client, 60)
    most = max(target.memory() for _ in range(20) if not time.sleep(0.05))
    stop.set()
    thread.join(60)
    return most - before


@pytest.mark.faults
@pytest.mark.slow
def test_floods_of_all_kinds_are_bounded_in_memory_and_a_good_host_is_served(target: TargetProcess) -> None:
    good = target.client(0)

    def requests(stop: threading.Event) -> None:
        with target.raw(4) as flood:
            while not stop.is_set():
                with suppress(zmq.Again):
                    flood.send(request("status"), zmq.NOBLOCK)

    def long_messages(stop: threading.Event) -> None:
        data = b"\xc6" + struct.pack(">I", REQUEST - 100) + bytes(REQUEST - 100)
        with target.raw(4) as flood:
            while not stop.is_set():
                with suppress(zmq.Again):
                    flood.send(data, zmq.NOBLOCK)
                time.sleep(0.01)

    def too_long(stop: threading.Event) -> None:
        while not stop.is_set():
            with target.raw(4) as flood:
                flood.send(bytes(REQUEST + 1))
                time.sleep(0.3)

    def connections(stop: threading.Event) -> None:
        while not stop.is_set():
            with suppress(OSError), socket.create_connection(("127.0.0.1", target.port)) as one:
                one.sendall(random.randbytes(200))

    def strangers(stop: threading.Event) -> None:
        while not stop.is_set():
            eve = made_pair("eve")
            with zmq.Context.instance().socket(zmq.DEALER) as one:
                one.linger = 0
                one.curve_publickey, one.curve_secretkey = eve.public, eve.private
                one.curve_serverkey = target.public
                one.connect(f"tcp://127.0.0.1:{target.port}")
                time.sleep(0.05)

    for attack in (requests, long_messages, too_long, connections, strangers):
        assert grown(target, good, attack) < ENOUGH, attack.__name__
    counts = good.request("status", 20)["wire"]["counts"]
    assert "porters lost" not in counts
    assert counts["dropped"] > 100 and counts["turned away"] > 5 and counts["malformed"] > 0
    good.close()


@pytest.mark.faults
@pytest.mark.slow
def test_a_host_that_does_not_read_costs_little_and_nobody_else_a_sample(target: TargetProcess) -> None:
    good = target.client(0)
    stream = int(good.request("hello")["stream"])
    with target.raw(3, stream) as slow:
        slow.send(request("subscribe", topics=["scope/1"]))
        until(lambda: good.request("status", 20)["wire"]["subscribers"], 60)
        scope = good.subscribe("scope/1", size=100_000)
        good.request("startscope", 60, ids=[1])
        before = target.memory()
        for _ in range(4):
            good.request("startscope", 60, ids=[1])
        for _ in range(5 * PACKAGES):
            scope.take(60)
        assert target.memory() - before < ENOUGH
        assert scope.missed == 0
        assert good.request("status", 20)["wire"]["dropped"] > 50  # until it was taken for dead
    good.close()


@pytest.mark.slow
def test_hosts_that_come_and_go_leave_nothing_behind(target: TargetProcess) -> None:
    good = target.client(0)

    def come_and_go(times: int) -> None:
        for _ in range(times):
            try:
                with target.client(3) as one:
                    one.subscribe("state", "scope/1")
            except WireError:  # too many in a short time
                time.sleep(0.5)

    come_and_go(10)
    before = target.memory()
    come_and_go(40)
    assert target.memory() - before < ENOUGH
    served(good)
    until(lambda: good.request("status", 20)["wire"]["connections"][0] <= 2)
    good.request("startscope", 60, ids=[1])
    until(lambda: good.request("status", 20)["wire"]["subscribers"] == [])
    good.close()
