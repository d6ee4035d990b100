"""The host's end of the wire: a thread that has the two sockets, and knows why a target does not answer."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Sequence
from typing import Any

import zmq

from quadvis.wire.address import WireAddress
from quadvis.wire.keys import KeyPair
from quadvis.wire.limits import DEAD_AFTER, HANDSHAKE, HEARTBEAT, MESSAGE
from quadvis.wire.monitor import next_event
from quadvis.wire.verbs import CONTROL, STREAM
from quadvis.wire.waker import Waker

_WAITING = 64  # messages that libzmq holds for us
_FULL = 500  # the status of a handshake: known, and no room
CONNECTING, CONNECTED, DENIED, FULL, OTHER_KEY, LOST = (
    "connecting",
    "connected",
    "denied",
    "full",
    "other key",
    "lost",
)


class _End:
    """One of the two sockets: a DEALER, and what its monitor says."""

    def __init__(
        self, context: zmq.Context[Any], address: WireAddress, pair: KeyPair | None, key: bytes
    ) -> None:
        self.socket = made = context.socket(zmq.DEALER)
        made.linger = 0
        made.immediate = True  # nothing waits for a connection that may come much later
        made.maxmsgsize = MESSAGE
        made.rcvhwm = made.sndhwm = _WAITING
        made.handshake_ivl = int(HANDSHAKE * 1000)
        made.heartbeat_ivl, made.heartbeat_timeout = int(HEARTBEAT * 1000), int(DEAD_AFTER * 1000)
        made.reconnect_ivl, made.reconnect_ivl_max = 100, 1000
        if ":" in address.host:
            made.ipv6 = True
        if pair is not None:
            made.curve_publickey, made.curve_secretkey, made.curve_serverkey = pair.public, pair.private, key
        self.monitor = made.get_monitor_socket()
        self.state = CONNECTING
        self.reached = False  # whether anything listens there
        self.outgoing: deque[tuple[bytes, Callable[[], bool]]] = deque()
        made.connect(address.endpoint)

    def watch(self) -> list[str]:
        """Note what happened to the connection; return its new states, in their order."""
        states = []
        while self.monitor.poll(0):
            kind, value = next_event(self.monitor)
            before = self.state
            if kind == zmq.Event.CONNECTED:
                self.reached = True
            elif kind == zmq.Event.HANDSHAKE_SUCCEEDED:
                self.state = CONNECTED
            elif kind == zmq.Event.HANDSHAKE_FAILED_AUTH:
                self.state = FULL if value == _FULL else DENIED
            elif kind == zmq.Event.HANDSHAKE_FAILED_PROTOCOL:
                self.state = OTHER_KEY
            elif kind == zmq.Event.DISCONNECTED and self.state == CONNECTED:
                self.state = LOST
            if self.state != before:
                states.append(self.state)
        return states

    def flush(self) -> None:
        """Send what waits, if there is a connection; what nobody waits for any more is dropped."""
        while self.outgoing:
            data, wanted = self.outgoing[0]
            if wanted():
                if self.state != CONNECTED:
                    return
                try:
                    self.socket.send(data, zmq.NOBLOCK)
                except zmq.Again:
                    return
            self.outgoing.popleft()

    def close(self) -> None:
        """Close the sockets."""
        self.socket.disable_monitor()
        self.monitor.close(0)
        self.socket.close(0)


class Courier:
    """Carries messages until `close`; all callbacks come from its thread.

    ``on_reply(data)`` and ``on_stream(frames)`` are given what has come. ``on_change(socket, state)`` is
    called when a connection was made or lost, and ``beat()`` often; it returns the time to its next call (s).
    """

    def __init__(
        self,
        address: WireAddress,
        pair: KeyPair | None,
        key: bytes,
        *,
        on_reply: Callable[[bytes], object],
        on_stream: Callable[[Sequence[bytes]], object],
        on_change: Callable[[str, str], object],
        beat: Callable[[], float],
    ) -> None:
        self._pair, self._key = pair, key
        self._on_reply, self._on_stream, self._on_change, self._beat = on_reply, on_stream, on_change, beat
        self._context = zmq.Context()
        self._poller = zmq.Poller()
        self._ends: dict[str, _End] = {}
        self._calls: deque[Callable[[], object]] = deque()
        self._waker = Waker()
        self._poller.register(self._waker.fileno(), zmq.POLLIN)
        self._add(CONTROL, address)
        self._changed = threading.Condition()
        self._closing = False
        self._thread = threading.Thread(target=self._run, name=f"courier to {address}", daemon=True)
        self._thread.start()

    def wait(self, timeout: float, socket: str = CONTROL) -> str:
        """Wait for a connection, or for a reason why there is none; return the state."""
        with self._changed:
            settled = (CONNECTED, DENIED, FULL, OTHER_KEY)
            self._changed.wait_for(lambda: self._closing or self.state(socket) in settled, timeout)
            return self.state(socket)

    def state(self, socket: str = CONTROL) -> str:
        """Return the state of a connection."""
        end = self._ends.get(socket)
        if self._closing:
            return LOST
        return CONNECTING if end is None else end.state

    @property
    def reached(self) -> bool:
        """Whether anything listens at the address."""
        return self._ends[CONTROL].reached

    def post(
        self, data: bytes, wanted: Callable[[], bool], socket: str = CONTROL, *, first: bool = False
    ) -> None:
        """Send a message once there is a connection, unless ``wanted()`` is false by then.

        ``first`` puts it before all that waits; only callbacks can ask for this.
        """
        if first:
            self._ends[socket].outgoing.appendleft((data, wanted))
        else:
            self._call(lambda: self._ends[socket].outgoing.append((data, wanted)))

    def open_stream(self, address: WireAddress) -> None:
        """Connect to the second socket."""

        def opened() -> None:
            if STREAM not in self._ends:
                self._add(STREAM, address)

        self._call(opened)

    def _add(self, name: str, address: WireAddress) -> None:
        self._ends[name] = end = _End(self._context, address, self._pair, self._key)
        self._poller.register(end.socket, zmq.POLLIN)
        self._poller.register(end.monitor, zmq.POLLIN)

    def close(self) -> None:
        """Close the sockets, and wait for the end of the thread."""
        self._closing = True
        self._waker.wake()
        if self._thread is not threading.current_thread():
            self._thread.join()

    def _run(self) -> None:
        try:
            while not self._closing:
                self._turn()
        finally:
            self._closing = True
            for end in self._ends.values():
                end.close()
            self._context.term()
            with self._changed:
                self._changed.notify_all()
            self._waker.close()

    def _turn(self) -> None:
        pause = self._beat()
        if any(end.outgoing for end in self._ends.values()):
            pause = min(pause, 0.02)
        ready = dict(self._poller.poll(int(pause * 1000) + 1))
        if self._waker.fileno() in ready:
            self._waker.drain()
        while self._calls:
            self._calls.popleft()()
        for name, end in list(self._ends.items()):
            for state in end.watch() if end.monitor in ready else ():
                with self._changed:
                    self._changed.notify_all()
                self._on_change(name, state)
            end.flush()
            if end.socket in ready:
                self._receive(name, end)

    def _receive(self, name: str, end: _End) -> None:
        for _ in range(_WAITING):
            if not end.socket.get(zmq.EVENTS) & zmq.POLLIN:  # cheaper than an exception
                return
            frames = end.socket.recv_multipart(zmq.NOBLOCK)
            if name == CONTROL:
                self._on_reply(frames[0])
            elif len(frames) == 3 and not frames[0]:
                self._on_reply(frames[1])
            else:
                self._on_stream(frames)

    def _call(self, call: Callable[[], object]) -> None:
        self._calls.append(call)
        self._waker.wake()
