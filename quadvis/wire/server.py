"""The target's end of the wire: two sockets for each way to reach it, and one thread that serves them all."""

from __future__ import annotations

import math
import socket
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import zmq

from quadvis.errors import QuadvisError
from quadvis.wire import limits
from quadvis.wire.address import LOOPBACK, checked_path, local_path
from quadvis.wire.audit import Audit
from quadvis.wire.budget import Tally, sparing
from quadvis.wire.desk import Desk, Handle
from quadvis.wire.doorkeeper import LOCAL, Doorkeeper
from quadvis.wire.entrance import Entrance, Letter
from quadvis.wire.feed import Feed, Key
from quadvis.wire.hosts import AuthorizedHosts
from quadvis.wire.introduction import introduce
from quadvis.wire.keys import KeyPair, checked_name
from quadvis.wire.lease import Lease
from quadvis.wire.ports import HeldPath, listeners, local_folder
from quadvis.wire.verbs import CONTROL, STREAM
from quadvis.wire.waker import Waker
from quadvis.wire.who import Who

_AT_ONCE = 32  # messages of one socket before the others have their turn
_REST, _SOON = 0.2, 0.005  # s between two looks at the clock; the same while something waits to be sent
_REREAD = 0.25  # s between two looks at the list of hosts


class Server:
    """Serves hosts until `close`; nothing listens before `listen_here` or `listen`.

    ``handle(verb, arguments, who)`` is the target, see `desk.Desk`; the thread of the server calls it, and so
    `handle` must return soon, if need be a Future. `publish` and `close` may be called from any thread.
    ``on_lost(who)`` is called when the operator's lease is lost, ``say`` with sentences for the target's own
    output, few a second.
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
            "unsubscribe": lambda args, who: self._feed.unsubscribe(who, args["topics"]),
        }
        self._context = zmq.Context()
        self._doorkeeper = Doorkeeper(self._context, hosts, self.counts, self._say)
        self._entrances: list[Entrance] = []
        self._introductions: list[socket.socket] = []
        self._held: list[HeldPath] = []
        self._calls: deque[Callable[[], object]] = deque()
        self._closing = threading.Event()
        self._thread: threading.Thread | None = None
        self._letter = Letter(b"", "", "", None)  # the one that is being answered
        self._next_reading = 0.0

    def listen_here(self, path: str | None = None) -> str:
        """Listen at a path that only this user can open, and return it; QuadvisError if it is taken."""
        path = checked_path(path or str(local_path(self.name)))
        local_folder(path)
        self._held.append(HeldPath(path, self.name))
        for entrance, place in zip(self._two_entrances(None), self._held[-1].sockets, strict=True):
            try:
                entrance.open_path(place)
            except zmq.ZMQError as error:
                raise QuadvisError(f"cannot listen at '{path}': {error.strerror.lower()}") from None
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
        pair = None if insecure else self._pair
        for entrance, listener in zip(self._two_entrances(pair), (control, stream), strict=True):
            entrance.open_port(listener)
        if pair is None:
            introductions.close()
        else:
            introductions.listen(limits.CONNECTIONS)
            self._introductions.append(introductions)
        return first

    def _two_entrances(self, pair: KeyPair | None) -> list[Entrance]:
        number = len(self._entrances)
        made = [Entrance(self._context, number + n, verbs, pair) for n, verbs in enumerate((CONTROL, STREAM))]
        self._entrances += made
        return made

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
        """Send data of a topic to all who have subscribed and may see it; it never waits, see `feed.Feed`."""
        self._feed.publish(topic, header, array)

    def wants(self, topic: str) -> bool:
        """Return whether anybody has subscribed to a topic, so that its data is worth being made."""
        return self._feed.wants(topic)

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
            "connections": [entrance.count() for entrance in self._entrances],
            "shut": sum(entrance.shut for entrance in self._entrances),
            "dropped": sum(entrance.outbox.all_dropped for entrance in self._entrances),
            "subscribers": list(self._feed.subscribers()),
            "audit_lost": 0 if self._audit is None else self._audit.lost,
        }

    def run(self) -> None:
        """Serve until `close` is called."""
        self._thread = threading.current_thread()
        poller = zmq.Poller()
        places: list[Any] = [self._waker, self._doorkeeper.socket, *self._introductions]
        places += [each.socket for each in self._entrances] + [each.monitor for each in self._entrances]
        for place in places:
            poller.register(place, zmq.POLLIN)
        try:
            while not self._closing.is_set():
                self._turn(poller)
        finally:
            self._end()

    def _turn(self, poller: zmq.Poller) -> None:
        ready = dict(poller.poll(math.ceil(self._pause() * 1000)))
        self._waker.drain()
        self._look_after()
        if self._doorkeeper.socket in ready:
            self._doorkeeper.answer({each.domain: each for each in self._entrances})
        for listener in self._introductions:
            if listener.fileno() in ready:
                self.counts.add("introduced", introduce(listener, self.name, self._public()))
        for entrance in self._entrances:
            if entrance.monitor in ready:
                entrance.count()
            for _ in range(_AT_ONCE if entrance.socket in ready else 0):
                letter = entrance.receive()
                if letter is None:
                    break
                self._open(entrance, letter)
        for _ in range(len(self._calls)):
            self._calls.popleft()()
        self._feed.deliver(self._present)
        for entrance in self._entrances:
            for identity in entrance.outbox.flush() if entrance.outbox.waits else ():
                self._feed.forget((entrance.number, identity))

    def _pause(self) -> float:
        if any(each.outbox.waits for each in self._entrances):
            return _SOON
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

    def _open(self, entrance: Entrance, letter: Letter) -> None:
        """Answer a message; whatever is wrong with it, the server goes on."""
        if letter.data is None:
            self.counts.add("malformed")
            self._say(f"a message of a wrong form came from {letter.address or 'this computer'}")
            return
        who = self._present(letter.user, letter.address, (entrance.number, letter.identity))
        head = [b""] if entrance.verbs == STREAM else []

        def send(data: bytes) -> None:
            if not entrance.outbox.send(letter.identity, [*head, data, *head]):
                self.counts.add("unread")

        self._letter = letter
        try:
            if who is None:
                self._desk.turn_away(letter.user.encode(), letter.data, send)
            else:
                self._desk.answer(who, letter.data, send, entrance.verbs)
        except Exception as error:
            self.counts.add("failed")
            self._say(f"a message could not be answered: {type(error).__name__}: {error}")

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
        number = who.connection[0]
        return {
            "target": self.name, "version": limits.VERSION, "key": who.name, "level": who.level,
            "stream": self._entrances[number + 1].place,
        }  # fmt: skip

    def _subscribe(self, args: Mapping[str, Any], who: Who) -> list[str]:
        entrance = self._entrances[who.connection[0]]
        return self._feed.subscribe(entrance, who, self._letter.user, self._letter.address, args["topics"])

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
        if self._context.closed:
            return
        self._desk.close()
        for entrance in self._entrances:
            entrance.outbox.flush()
            entrance.close()
        for listener in self._introductions:
            listener.close()
        self._doorkeeper.close()
        self._context.term()
        for path in self._held:
            path.release()
        self._waker.close()
        if self._audit is not None:
            self._audit.close()
