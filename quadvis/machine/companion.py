"""A companion: another program that runs beside this process, and ends with it, however this process ends.

A keeper starts the program. Its standard input is a pipe from this process: when that closes, since this
process says so or has ended, the keeper ends the program.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from quadvis.machine import companion_keeper

END = 3.0  # s that the keeper has to end
SHOWN = 300  # characters of the program's last words


class Companion:
    """A program that has been started in a folder; what it prints goes into a file there.

    ``priority`` is one of SCHED_FIFO, which it gets if the system grants it; 0 for none. With ``removes`` the
    folder is removed if this process ends first.
    """

    def __init__(
        self, command: Sequence[str], folder: Path, *, priority: int = 0, removes: bool = False
    ) -> None:
        self._log = folder / "printed.txt"
        removed = str(folder) if removes else ""
        keeper = [sys.executable, "-I", "-S", companion_keeper.__file__]
        self._process = subprocess.Popen(
            [*keeper, str(priority), removed, str(self._log), *command],
            cwd=folder,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,  # no terminal ends it before us
        )

    @property
    def code(self) -> int | None:
        """The exit code of the program; None while it runs."""
        return self._process.poll()

    def wait(self, seconds: float) -> bool:
        """Wait until it has ended by itself; return whether it has."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(seconds)
        return self.code is not None

    @property
    def last_words(self) -> str:
        """The last line that it has printed; "" if there is none."""
        try:
            lines = self._log.read_text("utf-8", "replace").splitlines()
        except OSError:
            return ""
        return next((line.strip()[:SHOWN] for line in reversed(lines) if line.strip()), "")

    def end(self) -> None:
        """End the program, and return when it has ended."""
        stdin = self._process.stdin
        if stdin is not None:
            stdin.close()
        if not self.wait(END):
            self._process.kill()
            self._process.wait()
