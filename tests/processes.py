"""Looks for the processes that a command under test has begun."""

from __future__ import annotations

import subprocess
import time
from pathlib import Path
from typing import Any

import pytest


def children(process: subprocess.Popen[Any]) -> list[int]:
    """Return the processes of its own that a command has begun."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            parent = (entry / "stat").read_text().rpartition(")")[2].split()[1]
            if int(parent) == process.pid and b"spawn_main" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:
            continue
    return found


def wait_for(condition: Any) -> Any:
    """Return what a condition gives once it gives something."""
    end = time.monotonic() + 60
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.02)
    raise AssertionError("it did not happen")


def gone(pid: int) -> bool:
    """Return whether a process has ended."""
    stat = Path(f"/proc/{pid}/stat")
    try:
        return stat.read_text().rpartition(")")[2].split()[0] == "Z"
    except OSError:
        return True


linux = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="looks for processes in /proc")
