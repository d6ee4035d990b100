"""The target of this machine: started by whoever needs it first, ended by itself when it is unused."""

from __future__ import annotations

import os
import subprocess
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
    from quadvis.wire.address import local_path, read_address
    from quadvis.wire.client import Client
    from quadvis.wire.refusals import NoAnswerError

    path = local_path(LOCAL)
    if _answers(path):
        return
    with tempfile.TemporaryFile() as output:
        process = subprocess.Popen(
            [sys.executable, "-m", "quadvis", "target", "--name", LOCAL, "--until-idle", str(UNUSED)],
            stdin=subprocess.DEVNULL, stdout=output, stderr=output, start_new_session=True, cwd="/",
        )  # fmt: skip
        until = time.monotonic() + START
        while time.monotonic() < until:
            if _answers(path):
                break
            code = process.poll()
            if code is not None and not _answers(path):  # another one may have been quicker
                output.seek(0)
                said = output.read().decode(errors="replace").strip().splitlines()
                raise QuadvisError(f"the target of this machine cannot start: {said[-1] if said else code}")
            time.sleep(LOOK)
        else:
            raise QuadvisError(f"the target of this machine does not answer after {START:g} s")
    with Client(read_address(str(path)), LOCAL) as client:
        try:
            client.connect()
        except NoAnswerError as error:
            raise QuadvisError(str(error)) from None


def _answers(path: Path) -> bool:
    """Return whether something listens at the path of a socket."""
    import socket

    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as found:
        try:
            found.connect(os.fspath(path))
        except OSError:
            return False
    return True
