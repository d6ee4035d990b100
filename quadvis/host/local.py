"""The target of this machine: started by whoever needs it first, ended by itself when it is unused."""

from __future__ import annotations

import os
import socket
import sys
import tempfile
import time
from pathlib import Path

from quadvis.errors import QuadvisError

LOCAL = "local"  # the name of the target
UNUSED = 30.0  # s without an application and without a request, after which it ends
START = 15.0  # s that it has to answer
LOOK = 0.05


def started_here() -> None:
    """See to it that the target of this machine's user runs; QuadvisError if it cannot be started."""
    from quadvis.wire.address import local_path

    path = local_path(LOCAL)
    until = time.monotonic() + START
    if not _listens(path):
        _start(path, until)
    while not _answers(path):
        _check(until)


def _start(path: Path, until: float) -> None:
    """Start the target, and return when there is one, be it another one that was quicker."""
    words = ["-m", "quadvis", "target", "--name", LOCAL, "--until-idle", str(UNUSED)]
    with tempfile.TemporaryFile() as output, open(os.devnull, "rb") as nothing:
        files = [
            (os.POSIX_SPAWN_DUP2, file.fileno(), number) for number, file in enumerate((nothing, output))
        ]
        files.append((os.POSIX_SPAWN_DUP2, output.fileno(), 2))
        # It belongs to nobody: it goes on when this process has ended.
        process = os.posix_spawn(
            sys.executable, [sys.executable, *words], os.environ, file_actions=files, setsid=True
        )
        while not _listens(path):
            if os.waitpid(process, os.WNOHANG)[0] and not _listens(path):
                output.seek(0)
                said = output.read().decode(errors="replace").strip().splitlines()
                raise QuadvisError(
                    f"the target of this machine cannot start{f': {said[-1]}' if said else ''}"
                )
            _check(until)


def _check(until: float) -> None:
    if time.monotonic() > until:
        raise QuadvisError(f"the target of this machine does not answer after {START:g} s")
    time.sleep(LOOK)


def _listens(path: Path) -> bool:
    """Return whether there is a target at the path of a socket."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as found:
        try:
            found.connect(os.fspath(path))
        except OSError:
            return False
    return True


def _answers(path: Path) -> bool:
    """Return whether a target takes connections at the path of a socket: ZeroMQ speaks first."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as found:
        try:
            found.settimeout(LOOK)
            found.connect(os.fspath(path))
            return bool(found.recv(1))
        except OSError:
            return False
