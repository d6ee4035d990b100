"""The target's end of the wire: one thread that answers what comes through the porter."""

from __future__ import annotations

import math
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

from quadvis.errors import QuadvisError
from quadvis.machine.files import reason
from quadvis.wire import limits
from quadvis.wire.address import LOOPBACK, checked_path, local_path
from quadvis.wire.audit import Audit
from quadvis.wire.budget import Tally, sparing
from quadvis.wire.desk import Desk, Handle
from quadvis.wire.doorkeeper import LOCAL, Doorkeeper
from quadvis.wire.feed import Feed
from quadvis.wire.hosts import AuthorizedHosts
from quadvis.wire.introduction import introduce
from quadvis.wire.keys import KeyPair, checked_name
from quadvis.wire.lease import Lease
from quadvis.wire.porter import Key, Porter
from quadvis.wire.ports import HeldPath, ListeningSocket, listeners, local_folder
from quadvis.wire.refusals import BadError
from quadvis.wire.verbs import CONTROL, STREAM
from quadvis.wire.waker import Waker
from quadvis.wire.who import Who

_AT_ONCE = 64  # messages of the porter before the rest has its turn
_REST = 0.2  # s between two looks at the clock
_REREAD = 0.25  # s between two looks at the list of hosts


class Server:
    """Serves hosts until `close`; nothing listens before `listen_here` or `listen`.

    ``handle(verb, arguments, who)`` is the target, see `desk.Desk`; the thread of the server calls it, and so
    `handle` must return soon, if need be a Future. `publish` and `close` may be called from any thread.
    ``on_lost(who)`` is called when the operator's lease is lost, ``say`` with sentences for the target's own
    output, few a second. ``memory`` is what the porter may take for its peers (bytes).
    """

    def __init__(
        self,
        name: str,
        handle: Handle,
        *,
        hosts: AuthorizedHosts | None = None,
        pair: KeyPair | None = None,
        audit: Audit | None = None,
        on_lost: Callable[[Who], object] = lambda who: None,
        say: Callable[[str], object] = lambda words: None,
        memory: int = limits.PORTER_MEMORY,
    ) -> None:
        self.name = checked_name(name)
        self.counts = Tally()
        self.lease = Lease(self._lost)
        self._waker = Waker()
        self._feed = Feed(self.counts, self._waker.wake)
        self._hosts, self._pair, self._audit, self._on_lost = hosts, pair, audit, on_lost
        self._say = sparing(say)
        self._desk = Desk(
            self.name, handle, lease=self.lease, counts=self.counts, audit=audit, later=self._call,
            say=self._say, facts=self.facts,
        )  # fmt: skip
        self._desk.own |= {
            "hello": self._hello,
            "subscribe": self._subscribe,
            "unsubscribe": self._unsubscribe,
        }
        self._doorkeeper = Doorkeeper(hosts, self.counts, self._say)
        self._listeners: list[ListeningSocket] = []
        self.porter = Porter(self._listeners, pair, self._porter_lost, memory)
        self._heard: dict[str, Callable[..., None]] = {
            "knock": self._knocked,
            "handshake": self._doorkeeper.note,
            "letter": self._open,
            "gone": self._gone,
        }
        self._introductions: list[socket.socket] = []
        self._held: list[HeldPath] = []
        self._calls: deque[Callable[[], object]] = deque()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._sender = ("", "")  # user and address of the message that is being answered
        self._closed = False
        self._more = False  # whether the porter has said more than was heard yet
        self._next_reading = 0.0

    def listen_here(self, path: str | None = None) -> str:
        """Listen at a path that only this user can open, and return it; QuadvisError if it is taken."""
        path = checked_path(path or str(local_path(self.name)))
        local_folder(path)
        self._held.append(HeldPath(path, self.name))
        try:
            for verbs, place in zip((CONTROL, STREAM), self._held[-1].sockets, strict=True):
                self._listeners.append(ListeningSocket.at_path(place, verbs))
        except OSError as error:
            raise QuadvisError(f"cannot listen at '{path}': {reason(error)}") from None
        return path

    def listen(self, host: str = "0.0.0.0", port: int = limits.PORT, *, insecure: bool = False) -> int:
        """Listen at three TCP ports from ``port`` on (0: any), for hosts with a key; return the first.

        ``insecure`` is for trials on one computer: no keys, and only the loopback can be listened at.
        """
        if insecure and host not in LOOPBACK:
            raise QuadvisError(f"without keys a target listens at 127.0.0.1 alone, not at {host}")
        if not insecure and (self._pair is None or self._hosts is None):
            raise QuadvisError(
                f"a target needs a key of its name to listen at a port; run 'quadvis keys new {self.name}'"
            )
        control, introductions, stream = listeners(host, port)
        first = int(control.getsockname()[1])
        for verbs, bound in zip((CONTROL, STREAM), (control, stream), strict=True):
            self._listeners.append(ListeningSocket.at_port(bound, verbs, keyed=not insecure))
        if insecure:
            introductions.close()
        else:
            introductions.listen(limits.CONNECTIONS)
            self._introductions.append(introductions)
        return first

    def start(self) -> Server:
        """Serve in a thread of its own."""
        self._thread = threading.Thread(target=self.run, name=f"wire of {self.name}", daemon=True)
        self._thread.start()
        return self

    def __enter__(self) -> Server:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def publish(self, topic: str, header: Mapping[str, Any], array: Any = None) -> None:
        """Send data of a topic to all who have subscribed and may see it; it never waits, see `feed.Feed`.

        Data that is too long is counted and reported here: a flight must not end by what hosts want to see.
        """
        try:
            self._feed.publish(topic, header, array)
        except BadError as error:
            self.counts.add("unsent")
            self._say(f"data of '{topic}' cannot be sent: {error}")

    def wants(self, topic: str) -> bool:
        """Return whether anybody has subscribed to a topic, so that its data is worth being made."""
        return self._feed.wants(topic)

    @property
    def serves(self) -> bool:
        """Whether hosts are served now: a porter that starts takes a moment."""
        return self.porter.serves

    def close(self) -> None:
        """Answer what is under way, close all sockets and wait for the end of the thread."""
        self._closing.set()
        self._waker.wake()
        if self._thread is None:
            self._end()
        elif self._thread is not threading.current_thread():
            self._thread.join()

    def facts(self) -> dict[str, Any]:
        """Return the counts, the connections and the subscribers; for the thread of the server."""
        return {
            "counts": self.counts.all(),
            "connections": list(self.porter.connected),
            "shut": self.porter.shut,
            "dropped": self.porter.dropped(),
            "subscribers": list(self._feed.subscribers(self.porter.dropped)),
            "audit_lost": 0 if self._audit is None else self._audit.lost,
        }

    def run(self) -> None:
        """Serve until `close` is called."""
        self._thread = threading.current_thread()
        try:
            while not self._closing.is_set():
                self._turn()
        finally:
            self._end()

    def _turn(self) -> None:
        pause = min(self.porter.watch(), self._pause())
        ready = self._ready(pause)
        self._waker.drain()
        self._look_after()
        for listener in self._introductions:
            if listener.fileno() in ready:
                self.counts.add("introduced", introduce(listener, self.name, self._public()))
        self._listen_to_porter()
        for _ in range(len(self._calls)):
            self._calls.popleft()()
        self._feed.deliver(self.porter, self._present)
        self.porter.flush()

    def _ready(self, pause: float) -> set[int]:
        """Wait until there is something to do, or for a time (s); return the descriptors to be read."""
        poller = select.poll()
        poller.register(self._waker, select.POLLIN)
        for listener in self._introductions:
            poller.register(listener, select.POLLIN)
        self.porter.register(poller)
        return {descriptor for descriptor, _ in poller.poll(0 if self._more else math.ceil(pause * 1000))}

    def _listen_to_porter(self) -> None:
        """Do what the porter says; whatever is wrong with a message, the server goes on."""
        self._more = True
        for _ in range(_AT_ONCE):
            message = self.porter.take()
            if message is None:
                self._more = False
                return
            try:
                self._heard[message[0]](*message[1:])
            except Exception as error:
                self.counts.add("failed")
                self._say(f"a message could not be answered: {type(error).__name__}: {error}")

    def _pause(self) -> float:
        times = (_REST, self.lease.watch(), self._desk.watch())
        return max(0.0, min(each for each in times if each is not None))

    def _look_after(self) -> None:
        """Do what is due by the clock: the lease, deadlines, the list of hosts."""
        self.lease.watch()
        self._desk.watch()
        now = time.monotonic()
        if self._hosts is None or now < self._next_reading:
            return
        self._next_reading = now + _REREAD
        if self._hosts.refresh():
            for fault in self._hosts.faults:
                self._say(str(fault))
            holder = self.lease.operator
            if holder is not None and holder.public and holder.public not in {h.public for h in self._hosts}:
                self.lease.withdraw()

    def _knocked(self, number: int, address: str, mechanism: str, key: bytes) -> None:
        user = ""
        try:
            user = self._doorkeeper.user(self._listeners[number], address, mechanism, key)
        finally:
            self.porter.admit(user)  # in any case: the next ones wait for this answer

    def _gone(self, number: int, identity: bytes) -> None:
        self.counts.add("unread")
        self._feed.forget(self.porter.key(number, identity))

    def _porter_lost(self, words: str) -> None:
        self.counts.add("porters lost")
        self._feed.forget_all()
        if self._audit is not None:
            self._audit.note(words)
        self._say(words)

    def _open(self, number: int, identity: bytes, user: str, address: str, data: bytes | None) -> None:
        """Answer a message."""
        if data is None:
            self.counts.add("malformed")
            self._say(f"a message of a wrong form came from {address or 'this computer'}")
            return
        key, verbs = self.porter.key(number, identity), self._listeners[number].verbs
        who = self._present(user, address, key)
        head = [b""] if verbs == STREAM else []

        def send(data: bytes) -> None:
            if not self.porter.send([key], [*head, data, *head]):
                self.counts.add("unread")

        self._sender = user, address
        if who is None:
            self._desk.turn_away(user.encode(), data, send)
        else:
            self._desk.answer(who, data, send, verbs)

    def _present(self, user: str, address: str, key: Key) -> Who | None:
        """Return who a sender is by the present list, None if the key is let in no more."""
        if user == LOCAL:
            return Who("this computer's user", 0, b"", key)
        host = None
        if self._hosts is not None:
            with suppress(ValueError):
                host = self._hosts.find(bytes.fromhex(user), address)
        return None if host is None else Who(host.name, host.level, host.public, key)

    def _hello(self, args: Mapping[str, Any], who: Who) -> dict[str, Any]:
        stream = self._listeners[who.connection[0] + 1]
        return {
            "target": self.name, "version": limits.VERSION, "key": who.name, "level": who.level,
            "stream": stream.place,
        }  # fmt: skip

    def _subscribe(self, args: Mapping[str, Any], who: Who) -> list[str]:
        return self._feed.subscribe(who, *self._sender, args["topics"])

    def _unsubscribe(self, args: Mapping[str, Any], who: Who) -> list[str]:
        left = self._feed.unsubscribe(who, args["topics"])
        if not left:
            self.porter.forget(who.connection)
        return left

    def _lost(self, who: Who) -> None:
        if self._audit is not None:
            self._audit.note(f"the lease of {who.name} is lost")
        try:
            self._on_lost(who)
        except Exception as error:
            self.counts.add("failed")
            self._say(f"what follows the loss of the lease failed: {type(error).__name__}: {error}")

    def _public(self) -> bytes:
        return b"" if self._pair is None else self._pair.public

    def _call(self, call: Callable[[], object]) -> None:
        self._calls.append(call)
        self._waker.wake()

    def _end(self) -> None:
        if self._closed:
            return
        self._closed = True
        self._desk.close()
        self.porter.close()
        for listener in (*self._introductions, *(each.bound for each in self._listeners)):
            listener.close()
        for path in self._held:
            path.release()
        self._waker.close()
        if self._audit is not None:
            self._audit.close()
