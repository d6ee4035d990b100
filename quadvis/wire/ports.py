"""The ports and paths at which a target listens, itself: they outlive the porter, which accepts there."""

from __future__ import annotations

import math
import os
import socket
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path

from quadvis.errors import QuadvisError
from quadvis.machine.files import reason
from quadvis.wire.home import private_folder
from quadvis.wire.limits import HALF_OPEN, HANDSHAKE

_TRIES = 50


@dataclass(frozen=True)
class ListeningSocket:
    """A socket that listens for ``verbs`` (of control, or of the stream), and its port or path as ``place``.

    Whoever comes to one that is ``keyed`` has to show a key.
    """

    bound: socket.socket
    place: int | str
    verbs: str
    keyed: bool

    @classmethod
    def at_port(cls, bound: socket.socket, verbs: str, *, keyed: bool) -> ListeningSocket:
        """Listen at a TCP socket that is bound."""
        with suppress(OSError, AttributeError):  # Linux: who is silent is not even accepted
            bound.setsockopt(socket.IPPROTO_TCP, socket.TCP_DEFER_ACCEPT, math.ceil(HANDSHAKE))
        bound.listen(2 * HALF_OPEN)  # a short queue would keep good hosts waiting in an attack
        return cls(bound, int(bound.getsockname()[1]), verbs, keyed)

    @classmethod
    def at_path(cls, path: str, verbs: str) -> ListeningSocket:
        """Listen at a path that this process holds: what is there was left behind. OSError if it cannot."""
        with suppress(FileNotFoundError):
            os.unlink(path)
        made = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            made.setblocking(False)
            made.bind(path)
            made.listen(2 * HALF_OPEN)
        except BaseException:
            made.close()
            raise
        return cls(made, path, verbs, False)


def listeners(host: str, port: int) -> list[socket.socket]:
    """Return three bound TCP sockets at neighbouring ports: control, introductions, stream."""
    for last in range(_TRIES if port == 0 else 1, 0, -1):
        with ExitStack() as opened:
            try:
                first = opened.enter_context(_bound(host, port))
                start = int(first.getsockname()[1])
                found = [first, *(opened.enter_context(_bound(host, start + n)) for n in (1, 2))]
            except (OSError, OverflowError) as error:
                if last == 1:
                    words = getattr(error, "strerror", None) or str(error)
                    raise QuadvisError(
                        f"cannot listen at {host}, ports {port} to {port + 2}: {words.lower()}"
                    ) from None
                continue
            opened.pop_all()
            return found
    raise AssertionError


def _bound(host: str, port: int) -> socket.socket:
    made = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_STREAM)
    try:
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        made.setblocking(False)
        made.bind((host, port))
    except BaseException:
        made.close()
        raise
    return made


def local_folder(path: str) -> Path:
    """Return the folder of a socket, which only its owner can open."""
    return private_folder(Path(path).parent)


class HeldPath:
    """A path at which this process alone may listen, with its two sockets, until `release`.

    Whoever listens at a path takes it away from whoever listened there. QuadvisError if another process has
    it.
    """

    def __init__(self, path: str, target: str) -> None:
        self.sockets = path, f"{path}.stream"
        self._lock = f"{path}.lock"
        try:
            while not self._is_ours(descriptor := self._locked()):
                os.close(descriptor)
        except BlockingIOError:
            raise QuadvisError(f"a target '{target}' runs already: it listens at '{path}'") from None
        except OSError as error:
            raise QuadvisError(f"cannot listen at '{path}': {reason(error)}") from None
        self._descriptor = descriptor

    def _locked(self) -> int:
        """Return a lock, as an open file."""
        import fcntl

        descriptor = os.open(self._lock, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            os.close(descriptor)
            raise
        return descriptor

    def _is_ours(self, descriptor: int) -> bool:
        """Return whether the file of a lock is still there: whoever had it before may have removed it."""
        with suppress(FileNotFoundError):
            return os.path.samestat(os.fstat(descriptor), os.stat(self._lock))
        return False

    def release(self) -> None:
        """Remove the files, those of the sockets first: they are closed."""
        for path in (*self.sockets, self._lock):
            with suppress(OSError):
                os.unlink(path)
        os.close(self._descriptor)
