"""What runs in the porter: the process that has all of ZeroMQ's sockets, and nothing else of a target.

Whatever a peer makes libzmq do, even end its process or take memory without end, happens here. The porter
proves who a peer is; what a peer may do, the target says. The messages to and from the target are lists that
begin with a word; an entrance is named by its number:

    from the target    open, entrances, keys, memory     once, at first
                       user, name                        the answer to "knock"; "" is a stranger
                       send, entrance, identities, frames
                       forget, entrance, identity        drop what waits for a connection
    from the porter      facts, connected, shut, dropped, dropped by connection    often: the sign of life
                       knock, entrance, address, mechanism, key                  a handshake asks who this is
                       handshake, status, address, key                           how it ended
                       letter, entrance, identity, user, address, data           nil for data of a wrong form
                       gone, entrance, identity          what was sent finds nobody

This module imports little: the process is there soon, also when it has to be started again.
"""

from __future__ import annotations

import os
import resource
import signal
import socket
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import zmq

from quadvis.wire.entrance import Entrance
from quadvis.wire.limits import MESSAGE, PORTER_LIFE
from quadvis.wire.outbox import Outbox
from quadvis.wire.pipe import Pipe

_AT_ONCE = 32  # messages of one socket before the others have their turn
_ENOUGH = 1 << 20  # bytes that wait for the target; no further messages are taken from hosts
_SOON, _SLOWLY = 1, 5  # ms between two looks while something waits for hosts; while they take nothing
_ZAP = "inproc://zeromq.zap.01"
_SPARE = 1 << 16  # bytes of a message of the target beyond what it sends to hosts
_FIRST_TO_GO = "500"  # when the system lacks memory (proc(5), oom_score_adj)


def main(descriptor: int) -> None:
    """Be the porter of the target at the other end of a socket, until that closes, then end the process."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)  # systemd sends it to all; our end follows the target's
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))  # the private key is in our memory
    with suppress(OSError), open("/proc/self/oom_score_adj", "w", encoding="ascii") as file:
        file.write(_FIRST_TO_GO)
    pipe = Pipe(socket.socket(fileno=descriptor), MESSAGE + _SPARE)
    try:
        PorterProcess(pipe).run()
    except BaseException as error:  # such as a lack of memory: to close the sockets might take for ever
        os.write(2, f"{type(error).__name__}: {error}\n".encode())
        os._exit(1)
    os._exit(0)


class PorterProcess:
    """The sockets, and one thread that serves them."""

    def __init__(self, pipe: Pipe) -> None:
        """Wait for the target's first message, and open what it says."""
        self._pipe = pipe
        self._obeyed: dict[str, Callable[..., None]] = {
            "user": self._admit,
            "send": self._send,
            "forget": self._forget,
        }
        self._context = zmq.Context()
        self._questions = self._context.socket(zmq.REP)  # of all handshakes (https://rfc.zeromq.org/spec/27)
        self._questions.linger = 0
        self._questions.bind(_ZAP)
        self._question: list[bytes] = []  # the one that the target has not answered yet
        self._entrances: list[Entrance] = []
        self._reported: tuple[Any, ...] = ()
        self._next_report = 0.0
        _, *order = self._first()
        self._open(*order)
        self._patient, self._listening = zmq.Poller(), zmq.Poller()
        for poller in (self._patient, self._listening):
            for place in (pipe.fileno(), self._questions, *(each.monitor for each in self._entrances)):
                poller.register(place, zmq.POLLIN)
        for each in self._entrances:
            self._listening.register(each.socket, zmq.POLLIN)

    def _first(self) -> list[Any]:
        poller = zmq.Poller()
        poller.register(self._pipe.fileno(), zmq.POLLIN)
        while (message := self._pipe.take()) is None:
            poller.poll()
        return message

    def _open(self, entrances: Sequence[Sequence[Any]], keys: list[bytes] | None, memory: int) -> None:
        for number, (descriptor, place, ipv6, keyed) in enumerate(entrances):
            pair = (keys[0], keys[1]) if keyed and keys else None
            made = Entrance(self._context, str(number), place, pair)
            made.open(descriptor, ipv6)
            self._entrances.append(made)
        _bound_memory(memory)

    def run(self) -> None:
        """Serve until the target closes its end; then what was sent has a moment to leave."""
        with suppress(EOFError):
            while True:
                self._turn()
        for entrance in self._entrances:
            entrance.outbox.flush()
            entrance.close()
        self._questions.close(0)
        self._context.term()

    def _turn(self) -> None:
        poller = self._patient if self._pipe.waiting else self._listening
        poller.modify(self._pipe.fileno(), zmq.POLLIN | (zmq.POLLOUT if self._pipe.waiting else 0))
        ready = dict(poller.poll(self._pause()))
        while (message := self._pipe.take()) is not None:
            self._obeyed[message[0]](*message[1:])
        if self._questions in ready and not self._question:
            self._ask()
        for entrance in self._entrances:
            if entrance.monitor in ready:
                entrance.count()
        self._report()
        for number, entrance in enumerate(self._entrances):
            if entrance.socket in ready:
                self._pass_on(number, entrance)
            for identity in entrance.outbox.flush() if entrance.outbox.waits else ():
                self._pipe.put("gone", number, identity)
        self._pipe.flush()

    def _pause(self) -> int:
        """Return how long to wait for a message (ms). libzmq does not say when a host takes data again."""
        waiting = [each.outbox.moves for each in self._entrances if each.outbox.waits]
        if not waiting:
            return int(PORTER_LIFE * 1000)
        return _SOON if any(waiting) else _SLOWLY

    def _pass_on(self, number: int, entrance: Entrance) -> None:
        for _ in range(_AT_ONCE):
            if self._pipe.waiting > _ENOUGH:
                return
            letter = entrance.receive()
            if letter is None:
                return
            self._pipe.put("letter", number, *letter)

    def _ask(self) -> None:
        """Ask the target about one handshake; the next ones wait."""
        self._question = self._questions.recv_multipart()
        _, _, domain, address, _, mechanism, *shown = self._question
        place = address.decode("ascii", "replace")
        self._pipe.put("knock", int(domain), place, mechanism.decode("ascii", "replace"), b"".join(shown[:1]))

    def _admit(self, user: str) -> None:
        """End the handshake that was asked about."""
        version, request, domain, address, _, _, *shown = self._question
        self._question = []
        place = address.decode("ascii", "replace")
        status = 400 if not user else 200 if self._entrances[int(domain)].let_in(user, place) else 500
        self._pipe.put("handshake", status, place, b"".join(shown[:1]))
        name = user.encode() if status == 200 else b""
        self._questions.send_multipart([version, request, b"%d" % status, b"", name, b""])

    def _outbox(self, number: int) -> Outbox:
        return self._entrances[number].outbox

    def _send(self, number: int, identities: Sequence[bytes], frames: Sequence[bytes]) -> None:
        for identity in identities:
            if not self._outbox(number).send(identity, frames):
                self._forget(number, identity)
                self._pipe.put("gone", number, identity)

    def _forget(self, number: int, identity: bytes) -> None:
        self._outbox(number).forget(identity)

    def _report(self) -> None:
        """Say how many are connected, and what has been shut and dropped, if it is new or time to."""
        now = time.monotonic()
        facts = (
            [each.connected for each in self._entrances],
            sum(each.shut for each in self._entrances),
            sum(each.outbox.all_dropped for each in self._entrances),
        )
        if facts == self._reported and now < self._next_report:
            return
        self._reported, self._next_report = facts, now + PORTER_LIFE
        dropped = [
            (number, identity, count)
            for number, each in enumerate(self._entrances)
            for identity, count in each.outbox.dropped.items()
        ]
        self._pipe.put("facts", *facts, dropped)


def _bound_memory(more: int) -> None:
    """Let this process take some bytes more than it has; libzmq ends it when it gets none."""
    with open("/proc/self/status", encoding="ascii") as file:
        status = file.read()
    used = 1024 * int(status.partition("VmData:")[2].split()[0])
    resource.setrlimit(resource.RLIMIT_DATA, (used + more, used + more))
