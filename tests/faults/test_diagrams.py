"""Fault 12: hostile diagrams."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.faults.hostile import FILES, MOST_MEMORY, READER, made
from tests.processes import linux

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

TIME = 10.0  # s of the processor for one file; what it takes says tools/bench_faults


def test_12_hostile_diagrams_are_refused_with_their_places_little_memory_and_nothing_run(
    tmp_path: Path,
) -> None:
    paths = made(tmp_path)
    assert len(paths) == len(FILES) >= 50
    command = [sys.executable, "-c", READER, *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    found = [line.split(" ", 2) for line in done.stdout.splitlines()]
    assert len(found) == len(paths)
    for path, (seconds, megabytes, sentence) in zip(paths, found, strict=True):
        assert re.match(rf"{re.escape(str(path))}:\d+:\d+: .", sentence), (path.name, sentence)
        assert float(megabytes) < MOST_MEMORY and float(seconds) < TIME, (path.name, seconds, megabytes)
    assert not (tmp_path / "run").exists() and sorted(tmp_path.iterdir()) == sorted(paths)
