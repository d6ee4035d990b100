"""What the tests of the wire have in common: a target that keeps values, hosts with keys, plain sockets."""

from __future__ import annotations

import itertools
import socket
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import zmq

from quadvis.wire.audit import Audit
from quadvis.wire.client import Client
from quadvis.wire.desk import Done
from quadvis.wire.hosts import AuthorizedHosts, allow
from quadvis.wire.keys import KeyPair, new_key
from quadvis.wire.meeting import meet
from quadvis.wire.messages import Request, pack_request
from quadvis.wire.refusals import NoAnswerError, UnknownError
from quadvis.wire.server import Server
from quadvis.wire.verbs import VERBS, Verb
from quadvis.wire.who import Who

DIGEST = "0" * 64
# What may be asked for, by verb: arguments that are right.
RIGHT: dict[str, dict[str, Any]] = {
    "align": {"shift": 5},
    "renew": {"token": "0" * 32}, "release": {"token": "0" * 32}, "load": {"application": "hover"},
    "getsignal": {"names": ["craft.position"]}, "watch": {"names": ["craft.position"]},
    "getparam": {"names": ["roll.gain"]},
    "setparam": {"values": {"roll.gain": 2.0}}, "settime": {"StopTime": 5.0}, "setlog": {"MaxLogSamples": 5},
    "remscope": {"ids": [1]}, "setscope": {"id": 1, "values": {"NumSamples": 100}},
    "startscope": {"ids": [1]}, "stopscope": {"ids": [1]}, "trigger": {"ids": [1]}, "setview": {"id": 1},
    "getscope": {"id": 1},
    "saveparamset": {"name": "a"}, "loadparamset": {"name": "a"}, "getparamset": {"name": "a"},
    "putparamset": {"name": "a", "values": {"roll.gain": 2.0}}, "deleteparamset": {"name": "a"},
    "setdefaultparamset": {"name": "a"},
    "getlog": {"name": "hover.mcap"}, "have": {"files": [DIGEST]},
    "put": {"file": DIGEST, "size": 3, "offset": 0, "data": b"abc"}, "picture": {"signal": "camera.frame"},
    "subscribe": {"topics": ["state"]}, "unsubscribe": {"topics": ["state"]},
}  # fmt: skip


class Echo:
    """A target that keeps parameters, and gives back what it was asked; ``calls`` are the verbs it heard."""

    def __init__(self) -> None:
        self.values: dict[str, Any] = {}
        self.calls: list[tuple[str, str]] = []
        self.futures: list[Future[Any]] = []
        self._ticks = itertools.count(100)

    def __call__(self, verb: str, args: Mapping[str, Any], who: Who) -> Any:
        self.calls.append((verb, who.name))
        if verb == "status":
            return {"Status": "stopped", "values": dict(self.values)}
        if verb == "setparam":
            old = {name: self.values.get(name) for name in args["values"]}
            self.values.update(args["values"])
            return Done(None, next(self._ticks), old, dict(args["values"]))
        if verb == "getparam":
            for name in args["names"]:
                if name not in self.values:
                    raise UnknownError(f"there is no parameter '{name}'")
            return {name: self.values[name] for name in args["names"]}
        if verb == "load":
            self.futures.append(Future())
            return self.futures[-1]
        if verb == "picture":
            raise ZeroDivisionError("a fault of the target")
        return {"verb": verb, "args": dict(args)}


class Rig:
    """A server on the loopback with keys, and hosts with keys of their own in one folder."""

    def __init__(self, folder: Path, **more: Any) -> None:
        self.folder, self.target, self.host = folder, folder / "target", folder / "host"
        for each in (self.target, self.host):
            each.mkdir(mode=0o700)
        self.pair, _ = new_key("lab1", self.target)
        self.echo = Echo()
        self.said: list[str] = []
        self.lost: list[Who] = []
        self.audit = folder / "audit" / "audit.jsonl"
        self.server = Server(
            "lab1", self.echo, hosts=AuthorizedHosts(self.target), pair=self.pair, audit=Audit(self.audit),
            on_lost=self.lost.append, say=self.said.append, **more,
        )  # fmt: skip
        self.port = self.server.listen("127.0.0.1", 0)
        self.clients: list[Client] = []

    def key(self, name: str, level: int | None = 0, networks: tuple[str, ...] = ()) -> KeyPair:
        """Make a host's key; let it in unless the level is None."""
        pair, _ = new_key(name, self.host)
        if level is not None:
            allow(name, pair.public.hex(), level, networks, self.target)
        return pair

    def client(self, name: str = "anna", timeout: float = 20.0) -> Client:
        """Return a connection with a key that exists."""
        client = meet(f"127.0.0.1:{self.port}", key=name, folder=self.host, timeout=timeout)
        self.clients.append(client)
        return client

    def close(self) -> None:
        for client in self.clients:
            client.close()
        self.server.close()

    def raw(
        self, pair: KeyPair | None, port: int | None = None, server: bytes | None = None
    ) -> zmq.Socket[Any]:
        """Return a plain DEALER with a key, as a program in another language has it."""
        made = zmq.Context.instance().socket(zmq.DEALER)
        made.linger = 0
        made.rcvtimeo = 20_000
        if pair is not None:
            made.curve_publickey, made.curve_secretkey = pair.public, pair.private
            made.curve_serverkey = server or self.pair.public
        made.connect(f"tcp://127.0.0.1:{port or self.port}")
        return made


def request(cmd: str, number: int = 1, **args: Any) -> bytes:
    """Return the bytes of a request."""
    return pack_request(Request(number, cmd, args, 10.0))


def until(what: Callable[[], Any], timeout: float = 20.0) -> Any:
    """Wait until something is true, and return it."""
    end = time.monotonic() + timeout
    while not (found := what()):
        assert time.monotonic() < end, "it did not come true"
        time.sleep(0.005)
    return found


def after_loss(ask: Callable[[], Any]) -> Any:
    """Ask; and again if the client was about to note that it has lost its connection."""
    try:
        return ask()
    except NoAnswerError:
        return ask()


def resident() -> float:
    """Return the memory of this process (MB)."""
    with open("/proc/self/statm", encoding="ascii") as file:
        return int(file.read().split()[1]) * 4096 / 1e6


def arguments(verb: Verb) -> dict[str, Any]:
    return RIGHT.get(verb.name, {})


class Proxy:
    """Passes bytes between a host and a port, keeps what the host sends, and may change it."""

    def __init__(self, port: int, change: Callable[[int, bytes], bytes] = lambda count, data: data) -> None:
        self.sent = bytearray()
        self._port, self._change = port, change
        self.port = 0
        self._open: list[socket.socket] = []
        self.listen()

    def listen(self) -> None:
        """Listen, again at the same port after `close`."""
        self._listener = socket.create_server(("127.0.0.1", self.port))
        self.port = int(self._listener.getsockname()[1])
        threading.Thread(target=self._accept, args=(self._listener,), daemon=True).start()

    def _accept(self, listener: socket.socket) -> None:
        while True:
            try:
                near, _ = listener.accept()
                far = socket.create_connection(("127.0.0.1", self._port))
            except OSError:
                return
            self._open += [near, far]
            threading.Thread(target=self._pass, args=(near, far, True), daemon=True).start()
            threading.Thread(target=self._pass, args=(far, near, False), daemon=True).start()

    def _pass(self, source: socket.socket, sink: socket.socket, from_host: bool) -> None:
        with suppress(OSError):
            while data := source.recv(65536):
                if from_host:
                    data = self._change(len(self.sent), data)
                    self.sent += data
                sink.sendall(data)
        for each in (source, sink):
            with_shutdown(each)

    def cut(self) -> None:
        """Close all connections; new ones are made again."""
        for each in self._open:
            with_shutdown(each)
        self._open.clear()

    def close(self) -> None:
        with_shutdown(self._listener)  # else the thread that waits there takes one more
        self.cut()


def with_shutdown(connection: socket.socket) -> None:
    with suppress(OSError):
        connection.shutdown(socket.SHUT_RDWR)
    connection.close()


@contextmanager
def proxied(port: int, **more: Any) -> Iterator[Proxy]:
    proxy = Proxy(port, **more)
    try:
        yield proxy
    finally:
        proxy.close()


ALL = list(VERBS.values())
