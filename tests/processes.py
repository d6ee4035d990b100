"""Looks for the processes that a command under test has begun."""

from __future__ import annotations

import os
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest


def children(process: subprocess.Popen[Any], program: bytes = b"spawn_main") -> list[int]:
    """Return the processes that a command has begun to run a program, by default those of a run."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parent = (entry / "stat").read_text().rpartition(")")[2].split()[1]
            if int(parent) == process.pid and program in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def holder(path: str, processes: list[int]) -> int:
    """Return the process, of these, that has a file open; 0 if none has."""
    for process in processes:
        with suppress(OSError):
            for link in Path(f"/proc/{process}/fd").iterdir():
                with suppress(OSError):
                    if os.readlink(link) == path:
                        return process
    return 0


def wait_for(condition: Any, patience: float = 60.0, pause: float = 0.02) -> Any:
    """Return what a condition gives once it gives something."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(pause)
    raise AssertionError("it did not happen")


def gone(pid: int) -> bool:
    """Return whether a process has ended."""
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
