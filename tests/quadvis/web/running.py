"""A gateway in a thread of its own, and pages that are programs."""

from __future__ import annotations

import asyncio
import json
import socket
import struct
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from websockets.sync.client import ClientConnection, connect

from quadvis.web.gateway import Gateway


class Running:
    """A gateway that serves; ``said`` is what it announced."""

    def __init__(self, target: Any) -> None:
        self.said: list[str] = []
        self.gateway = Gateway(target, self.said.append)
        self._ready = threading.Event()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(
            target=self._loop.run_until_complete, args=(self._serve(),), daemon=True
        )
        self._thread.start()
        assert self._ready.wait(20)

    async def _serve(self) -> None:
        self._end = asyncio.Event()
        async with self.gateway.serving(0):
            self._ready.set()
            await self._end.wait()

    def close(self) -> None:
        self._loop.call_soon_threadsafe(self._end.set)
        self._thread.join(20)
        assert not self._thread.is_alive()
        self._loop.close()

    @property
    def port(self) -> int:
        return int(self.gateway.address.partition(":")[2].partition(":")[2].partition("/")[0])

    @property
    def host(self) -> str:
        return f"127.0.0.1:{self.port}"

    def plain(self, request: bytes) -> bytes:
        """Send bytes; return all that comes back until the connection is closed."""
        with socket.create_connection(("127.0.0.1", self.port), 20) as line:
            line.sendall(request)
            found = b""
            try:
                while piece := line.recv(65536):
                    found += piece
            except ConnectionResetError:
                pass
            return found

    def get(self, path: str, **headers: str) -> bytes:
        given = {"Host": self.host, **{name.replace("_", "-"): value for name, value in headers.items()}}
        lines = [f"GET {path} HTTP/1.1", *(f"{name}: {value}" for name, value in given.items()), "", ""]
        return self.plain("\r\n".join(lines).encode())

    def dial(self, origin: str | None = "", **more: Any) -> ClientConnection:
        """Open a socket as a page does."""
        address = f"ws://{self.host}/live"
        own = f"http://{self.host}" if origin == "" else origin
        return connect(address, origin=own, compression=None, max_size=None, proxy=None, **more)

    @contextmanager
    def page(self, **more: Any) -> Iterator[Page]:
        """Have a page that is let in."""
        with self.dial(**more) as line:
            line.send(json.dumps({"token": self.gateway.access.token}))
            page = Page(line)
            page.hello = page.next(lambda message: "hello" in message)["hello"]
            yield page


class Page:
    """A page that answers beats while it waits for something."""

    hello: dict[str, Any]

    def __init__(self, line: ClientConnection) -> None:
        self.line, self.answers = line, True
        self.watched: dict[str, Any] = {"set": None}
        self._number = 0

    def take(self) -> dict[str, Any]:
        message = unpack(self.line.recv(20))
        if message.get("topic") == "watched":
            self.watched = message["data"]
        elif message.get("topic") == "values" and message["data"]["set"] == self.watched["set"]:
            message["values"] = self._by_name(message["data"]["without"], message["samples"])
        if "beat" in message and self.answers:
            self.line.send(json.dumps({"beat": message["beat"]}))
        return message

    def _by_name(self, without: list[int], numbers: Any) -> dict[str, Any]:
        parts = np.split(numbers, np.cumsum(self.watched["sizes"])[:-1])
        names = self.watched["names"]
        assert len(numbers) == sum(self.watched["sizes"]) and len(names) == len(self.watched["sizes"])
        return {
            name: None if place in without else part.tolist()
            for place, (name, part) in enumerate(zip(names, parts, strict=True))
        }

    def values(self) -> dict[str, Any]:
        """Return the next values, each as a list of numbers, by the names of their signals."""
        found: dict[str, Any] = self.next(lambda message: "values" in message)["values"]
        return found

    def next(self, wanted: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
        end = time.monotonic() + 20
        while not wanted(message := self.take()):
            assert time.monotonic() < end, "it did not come"
        return message

    def topic(self, name: str) -> dict[str, Any]:
        return self.next(lambda message: message.get("topic") == name)

    def ask(self, verb: str, **arguments: Any) -> int:
        self._number += 1
        self.line.send(json.dumps({"id": self._number, "verb": verb, "args": arguments}))
        return self._number

    def reply(self, number: int) -> dict[str, Any]:
        return self.next(lambda message: message.get("reply") == number)

    def request(self, verb: str, **arguments: Any) -> Any:
        reply = self.reply(self.ask(verb, **arguments))
        return reply["result"] if reply["ok"] else reply

    def refused(self, verb: str, **arguments: Any) -> str:
        reply = self.reply(self.ask(verb, **arguments))
        assert not reply["ok"]
        return str(reply["error"])


def unpack(message: str | bytes) -> dict[str, Any]:
    """Return a message of the gateway; numbers in bytes are ``samples``, other bytes ``data``."""
    if isinstance(message, str):
        return dict(json.loads(message))
    (length,) = struct.unpack_from("<I", message)
    found: dict[str, Any] = json.loads(message[4 : 4 + length])
    rest = message[4 + length :]
    assert (4 + length) % 8 == 0
    return found | (
        {"samples": np.frombuffer(rest).reshape(found["shape"])} if "shape" in found else {"payload": rest}
    )
