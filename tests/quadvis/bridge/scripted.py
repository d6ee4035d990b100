"""A target that says what a test wants, and a client of Foxglove's protocol, by its specification."""

from __future__ import annotations

import json
import struct
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import numpy as np
from websockets.sync.client import ClientConnection, connect

from quadvis.bridge.follower import BridgeEnd, Follower
from quadvis.errors import QuadvisError

BEGAN = 1_796_024_903_882_418_142


class ScriptedTarget:
    """An application with a craft at 100 Hz and a camera at 10 Hz. ``calls`` are the verbs that came."""

    name = "lab"

    def __init__(self, level: int = 0) -> None:
        self.level = level
        self.application = "scripted"
        self.values: dict[str, Any] = {"law.gain": "2.0 rad/s", "law.limit": float("inf"), "law.on": True}
        self.scopes: dict[int, dict[str, Any]] = {}
        self.calls: list[tuple[str, dict[str, Any]]] = []
        self.takers: dict[str, Callable[[Mapping[str, Any], Any], None]] = {}
        self.sequence = 1

    def signals(self) -> list[dict[str, Any]]:
        def fact(
            name: str, kind: str, shape: list[int], unit: str, task: str, period: float
        ) -> dict[str, Any]:
            return {"name": name, "type": kind, "shape": shape, "unit": unit, "task": task, "period": period,
                    "also": []}  # fmt: skip

        return [
            fact("craft.position", "float64", [3], "m", "fast", 0.01),
            fact("craft.attitude", "float64", [3], "rad", "fast", 0.01),
            fact("law.level", "int64", [], "1", "fast", 0.01),
            fact("eyes/detector.found", "bool", [], "1", "slow", 0.1),
        ]

    def subscribe(self, topic: str, take: Callable[[Mapping[str, Any], Any], None]) -> Callable[[], None]:
        self.takers[topic] = take
        return lambda: self.takers.pop(topic, None) and None

    def request(self, verb: str, /, **arguments: Any) -> Any:
        self.calls.append((verb, arguments))
        return getattr(self, f"do_{verb}")(**arguments)

    def do_status(self) -> dict[str, Any]:
        return {"Application": self.application, "Hash": self.application and "abc"}

    def do_pictures(self) -> list[str]:
        return ["eyes/camera.frame"]

    def do_scopes(self) -> list[dict[str, Any]]:
        return list(self.scopes.values())

    def do_addscope(self, id: int | None, type: str) -> int:
        number = next(each for each in range(1, 20) if each not in self.scopes)
        self.scopes[number] = {"id": number, "Type": type, "Signals": [], "Status": "Interrupted"}
        return number

    def do_setscope(self, id: int, values: Mapping[str, Any]) -> None:
        self.scopes[id] |= values

    def do_startscope(self, ids: list[int]) -> None:
        for each in ids:
            self.scopes[each]["Status"] = "Acquiring"

    def do_remscope(self, ids: list[int]) -> None:
        for each in ids:
            del self.scopes[each]

    def do_getparam(self, names: list[str]) -> dict[str, Any]:
        return dict(self.values)

    def do_setparam(self, values: Mapping[str, Any]) -> None:
        if "law.gain" in values and "rad/s" not in str(values["law.gain"]):
            raise QuadvisError("'law.gain' is in rad/s")
        changes = [{"name": name, "old": self.values[name], "new": new} for name, new in values.items()]
        self.values |= values
        self.takers["event"]({"event": "tuned", "changes": changes}, None)

    def do_picture(self, signal: str) -> dict[str, Any]:
        return {"format": "jpeg", "data": b"\xff\xd8picture", "width": 2, "height": 1, "time": 1.0,
                "stamp": 0.9, "sequence": self.sequence, "began": BEGAN}  # fmt: skip

    def scope_of(self, signal: str) -> int:
        """Return the scope that acquires a signal; 0 if none does."""
        found = [
            number
            for number, each in self.scopes.items()
            if signal in each["Signals"] and each["Status"] == "Acquiring"
        ]
        return found[0] if found else 0

    def samples(self, signal: str, rows: list[list[float]]) -> None:
        """Let samples come, each a time (s) and values, from the scope of a signal."""
        number = self.scope_of(signal)
        self.takers[f"scope/{number}"]({"scope": number, "began": BEGAN}, np.array(rows))


@contextmanager
def following(
    target: ScriptedTarget,
    end: BridgeEnd,
    *names: str,
    said: list[str],
    before: Callable[[Follower], None] = lambda follower: None,
) -> Iterator[Follower]:
    """Follow a target in another thread; ``before`` it is opened it is given to somebody."""
    follower = Follower(target, names, end, said.append)
    before(follower)
    thread = threading.Thread(target=follower.run, daemon=True)
    try:
        follower.open()
        thread.start()
        yield follower
    finally:
        follower.stop()
        if thread.is_alive():
            thread.join(20)
        follower.close()


class FoxgloveClient:
    """A client by the published protocol (github.com/foxglove/ws-protocol, docs/spec.md)."""

    def __init__(self, socket: ClientConnection) -> None:
        self._socket = socket
        self.info: dict[str, Any] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self.messages: dict[str, list[tuple[int, bytes]]] = {}
        self.parameters: dict[str, Any] = {}
        self.answers: dict[str, list[str]] = {}
        self.statuses: list[str] = []
        self.times: list[int] = []
        self._topics: dict[int, str] = {}

    @staticmethod
    @contextmanager
    def at(port: int) -> Iterator[FoxgloveClient]:
        with connect(f"ws://127.0.0.1:{port}", subprotocols=["foxglove.sdk.v1"]) as socket:  # type: ignore[list-item]
            yield FoxgloveClient(socket)

    def send(self, op: str, **fields: Any) -> None:
        self._socket.send(json.dumps({"op": op, **fields}))

    def subscribe(self, *topics: str) -> None:
        subscriptions = []
        for topic in topics:
            number = len(self._topics) + 1
            self._topics[number] = topic
            subscriptions.append({"id": number, "channelId": self.channels[topic]["id"]})
        self.send("subscribe", subscriptions=subscriptions)

    def until(self, condition: Callable[[], Any], patience: float = 60.0) -> Any:
        """Take what comes until a condition gives something; return that."""
        end = time.monotonic() + patience
        while not (found := condition()):
            assert time.monotonic() < end, "it did not come"
            try:
                self._take(self._socket.recv(timeout=0.05))
            except TimeoutError:
                continue
        return found

    def _take(self, message: str | bytes) -> None:
        if isinstance(message, bytes):
            if message[0] == 1:
                number, stamp = struct.unpack_from("<IQ", message, 1)
                self.messages.setdefault(self._topics[number], []).append((stamp, message[13:]))
            elif message[0] == 2:
                self.times += struct.unpack_from("<Q", message, 1)
            return
        found = json.loads(message)
        match found["op"]:
            case "serverInfo":
                self.info = found
            case "advertise":
                self.channels |= {each["topic"]: each for each in found["channels"]}
            case "unadvertise":
                gone = set(found["channelIds"])
                self.channels = {name: each for name, each in self.channels.items() if each["id"] not in gone}
            case "parameterValues":
                self.parameters |= {each["name"]: each.get("value") for each in found["parameters"]}
                self.answers[found.get("id", "")] = [each["name"] for each in found["parameters"]]
            case "status":
                self.statuses.append(found["message"])
