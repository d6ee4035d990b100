"""The porter as the target has it: a process that is started, watched, and started again however it ends."""

from __future__ import annotations

import os
import select
import signal
import socket
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from typing import Any

from quadvis.wire.keys import KeyPair
from quadvis.wire.limits import OUTGOING, PORTER_MEMORY, PORTER_SILENT, PORTER_START, REQUEST
from quadvis.wire.pipe import Pipe
from quadvis.wire.ports import ListeningSocket

# Of a connection: the number of an entrance, and an identity there that no other one ever has.
Key = tuple[int, bytes]

_PROGRAM = "from quadvis.wire.porter_process import main; main({})"
_SPARE = 1 << 16  # bytes of a message of the porter beyond what it has received
_STEADY = 10.0  # s that a porter has to last: one that ends before is not followed by the next one at once
_FIRST, _LONGEST = 0.1, 5.0  # s between an end and the next start; doubled from end to end
_CROWDED = 1 << 20  # bytes that wait for the porter; meanwhile no messages are taken from it
_CLOSING = 2.0  # s that it has to end when it is asked to
_AWAKE = 0.5  # s between two looks: while nobody listens for longer, the porter is not silent
_LAST_WORDS = 300  # characters


class Porter:
    """The process with ZeroMQ's sockets at some listeners; one thread of the target uses it.

    The listeners are taken when it starts. ``on_lost(words)`` is called with a sentence when a porter has
    ended by itself. Then all connections are gone, and further ones wait at the listeners for the next one.
    ``memory`` is what it may take for its peers (bytes).
    """

    def __init__(
        self,
        listeners: Sequence[ListeningSocket],
        pair: KeyPair | None,
        on_lost: Callable[[str], object],
        memory: int = PORTER_MEMORY,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.listeners = listeners
        self.pid = 0  # while there is one
        self.serves = False  # whether it takes connections
        self.connected: list[int] = []  # at each of the listeners
        self._pair, self._on_lost, self._memory, self._clock = pair, on_lost, memory, clock
        self._pipe: Pipe | None = None
        self._sums = (0, 0)  # connections shut and messages dropped, by earlier porters
        self._present = (0, 0)
        self._dropped: dict[Key, int] = {}
        self._count = 0  # porters so far
        self._pause = 0.0
        self._due = self._started = self._looked = 0.0
        self._silent, self._patience = 0.0, PORTER_START

    @property
    def shut(self) -> int:
        """How many connections were shut, as there were too many."""
        return self._sums[0] + self._present[0]

    def dropped(self, key: Key | None = None) -> int:
        """Return how many messages were dropped, as a host was slow: of one connection, or of all ever."""
        return self._sums[1] + self._present[1] if key is None else self._dropped.get(key, 0)

    def watch(self) -> float:
        """Start the porter when it is time to, end one that hangs; return when to look again (s)."""
        now = self._clock()
        if self._pipe is None:
            if now < self._due:
                return self._due - now
            self._start(now)
        self._silent += min(now - self._looked, _AWAKE)
        self._looked = now
        if self._silent > self._patience and self._pipe is not None:
            self._lost(f"as it gave no sign of life for {self._patience:g} s")
        return _AWAKE

    def _start(self, now: float) -> None:
        self._count += 1
        self._started = self._looked = now
        self.connected = [0] * len(self.listeners)
        self._silent, self._patience = 0.0, PORTER_START
        ours, its = socket.socketpair()
        with its:
            self._pipe = Pipe(ours, REQUEST + _SPARE)
            try:
                descriptors = [its.fileno(), *(each.bound.fileno() for each in self.listeners)]
                self._process, self._words = _begun(descriptors)
            except OSError as error:
                self._ended(f"the porter cannot be started ({error.strerror})")
                return
        self.pid = self._process.pid
        entrances = [
            (each.bound.fileno(), each.place, each.bound.family == socket.AF_INET6, each.keyed)
            for each in self.listeners
        ]
        keys = None if self._pair is None else (self._pair.public, self._pair.private)
        self._pipe.put("open", entrances, keys, self._memory)
        self._pipe.flush()

    def register(self, poller: select.poll) -> None:
        """Let a `select.poll` wait for what the porter says, and for room if something waits for it."""
        if self._pipe is not None:
            heard = 0 if self._crowded else select.POLLIN
            poller.register(self._pipe.fileno(), heard | (select.POLLOUT if self._pipe.waiting else 0))

    @property
    def _crowded(self) -> bool:
        return self._pipe is not None and self._pipe.waiting > _CROWDED

    def take(self) -> list[Any] | None:
        """Return the next message that is for the target, None if there is none now."""
        while self._pipe is not None and not self._crowded:
            try:
                message = self._pipe.take()
            except EOFError:
                self._lost()
                return None
            if message is None:
                return None
            self._silent, self._patience, self.serves = 0.0, PORTER_SILENT, True
            if message[0] != "facts":
                return message
            self._note(*message[1:])
        return None

    def _note(self, connected: list[int], shut: int, dropped: int, by_connection: list[Any]) -> None:
        self.connected, self._present = connected, (shut, dropped)
        self._dropped = {self.key(number, identity): count for number, identity, count in by_connection}

    def key(self, number: int, identity: bytes) -> Key:
        """Return the key of a connection of the porter that is there now.

        The number of the porter is in it: the next porter may give an identity of this one to another host.
        """
        return number, self._count.to_bytes(4, "big") + identity

    def admit(self, user: str) -> None:
        """Answer the porter's question who a peer is; "" is a stranger."""
        if self._pipe is not None:
            self._pipe.put("user", user)

    def send(self, keys: Iterable[Key], frames: Sequence[bytes]) -> bool:
        """Send a message to connections; return False if they are of an earlier porter, or too much waits."""
        if self._pipe is None or self._pipe.waiting > OUTGOING:
            return False
        to = defaultdict(list)
        for number, identity in keys:
            if self._is_present(identity):
                to[number].append(identity[4:])
        for number, identities in to.items():
            self._pipe.put("send", number, identities, frames)
        return bool(to)

    @property
    def has_room(self) -> bool:
        """Whether stream data should be sent now."""
        return not self._crowded

    def forget(self, key: Key) -> None:
        """Drop what waits for a connection."""
        if self._pipe is not None and self._is_present(key[1]):
            self._pipe.put("forget", key[0], key[1][4:])

    def _is_present(self, identity: bytes) -> bool:
        return int.from_bytes(identity[:4], "big") == self._count

    def flush(self) -> None:
        """Hand to the porter what it takes now."""
        if self._pipe is not None:
            self._pipe.flush()

    def _lost(self, why: str = "") -> None:
        """Note that the porter has ended, or end it since it hangs."""
        if not why:
            with suppress(subprocess.TimeoutExpired):  # it has closed its end; the system is not done with it
                self._process.wait(_AWAKE)
        self._process.kill()
        code = self._process.wait()
        words = _last_words(self._words)
        why = why or (f"by {signal.Signals(-code).name}" if code < 0 else f"with exit code {code}")
        self._ended(
            f"the porter, which has the network's sockets, has ended {why}{f' ({words})' if words else ''}"
        )

    def _ended(self, words: str) -> None:
        now = self._clock()
        assert self._pipe is not None
        self._pipe.close()
        self._pipe, self.pid, self.serves = None, 0, False
        self.connected = [0] * len(self.listeners)
        self._sums = self.shut, self.dropped()
        self._present, self._dropped = (0, 0), {}
        steady = now - self._started > _STEADY
        self._pause = 0.0 if steady else min(_LONGEST, max(_FIRST, 2 * self._pause))
        self._due = now + self._pause
        then = f"in {self._pause:g} s" if self._pause else "now"
        self._on_lost(f"{words}; all hosts have lost their connections, and a new porter starts {then}")

    def close(self) -> None:
        """Let the porter send what it has, and end it."""
        if self._pipe is None:
            return
        until = time.monotonic() + _CLOSING
        self._pipe.flush()
        while self._pipe.waiting and time.monotonic() < until:
            time.sleep(0.005)
            self._pipe.flush()
        self._pipe.end()
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(_CLOSING)
        self._process.kill()
        self._process.wait()
        os.close(self._words)
        self._pipe.close()
        self._pipe, self.pid = None, 0


def _begun(descriptors: Sequence[int]) -> tuple[subprocess.Popen[bytes], int]:
    """Start a porter that has some descriptors, the first to talk with us, in a session of its own.

    So no terminal ends it. It is returned with the descriptor at which its last words come.
    """
    read, write = os.pipe2(os.O_NONBLOCK | os.O_CLOEXEC)
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", _PROGRAM.format(descriptors[0])],
            env=os.environ | {"PYTHONPATH": os.pathsep.join(each or os.getcwd() for each in sys.path)},
            stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=write,
            pass_fds=descriptors, start_new_session=True,
        )  # fmt: skip
    except BaseException:
        os.close(read)
        raise
    finally:
        os.close(write)
    return process, read


def _last_words(descriptor: int) -> str:
    """Return the last line that a porter has written, and close the pipe."""
    with open(descriptor, "rb", buffering=0) as file:
        said = (file.read(1 << 16) or b"").decode("utf-8", "replace").splitlines()
    return next((line.strip()[:_LAST_WORDS] for line in reversed(said) if line.strip()), "")
