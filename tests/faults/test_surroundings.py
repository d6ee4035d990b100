"""Faults 7, 11, 17 and 18: a full disk, a clock that jumps, a rival, no descriptors, memory or readers."""

from __future__ import annotations

import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import pytest

from quadvis.output.log_reader import read_log
from tests.faults.bench import PATIENCE, Bench, no_trace
from tests.processes import gone, linux, wait_for

pytestmark = [pytest.mark.faults, pytest.mark.slow, linux]

MEMORY = "there is not enough memory; free some, or raise the limit (ulimit -v)"
ROOM = 256  # KiB of the small disk
SOURCE = Path(__file__).with_name("wall_clock.c")
DAY, YEARS = 86_400, 10  # s; and years
JUMPS = (DAY, -DAY, YEARS * 365 * DAY)  # s


@contextmanager
def small_disk(folder: Path) -> Iterator[Path | None]:
    """Yield a folder on a disk that is soon full; None where nobody may mount one."""
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", f"size={ROOM}k", "quadvis", str(folder)]
    try:
        mounted = subprocess.run(command, capture_output=True).returncode == 0
    except OSError:
        mounted = False
    try:
        yield folder if mounted else None
    finally:
        if mounted:
            subprocess.run(["umount", "-l", str(folder)], check=True)


def test_07_a_full_disk_costs_rows_and_no_flight(tmp_path: Path) -> None:
    with small_disk(tmp_path / "disk") as disk:
        # Where no disk can be mounted, the limit on the size of files says the same by another number.
        limit = [] if disk else ["prlimit", f"--fsize={ROOM << 10}"]
        log = (disk or tmp_path) / "flight.mcap"
        with Bench(tmp_path, "--stop-time", "5 s", log=log, before=limit) as bench:
            code, out, told = bench.ended()
            bench.left_safe()
            assert code == 1
            words = "no space left on device" if disk else "file too large"
            assert f"cannot write the log '{log}': {words}; it lacks " in told
            assert " rows, the first of t = " in told and "the run itself is judged in full" in told
            assert "expectations met" in out
            no_trace(told)
            assert bench.time >= 4.0 and bench.commands > 50
        held = read_log(log)
        assert 0.2 < (held.end or 0.0) < 4.5
        assert len(held["outputs.sent"]) > 5 and "is cut short" in held.damage


class WallClock:
    """A wall clock that jumps, for programs with this ``environment``."""

    def __init__(self, folder: Path) -> None:
        library, self._said = folder / "wall_clock.so", folder / "off"
        command = ["cc", "-shared", "-fPIC", "-O2", "-o", str(library), str(SOURCE), "-ldl"]
        subprocess.run(command, check=True)
        self.jump(0)
        self.environment = os.environ | {"LD_PRELOAD": str(library), "WALL_CLOCK": str(self._said)}

    def jump(self, seconds: int) -> None:
        """Let it be so many seconds off."""
        with open(self._said, "r+b" if self._said.exists() else "wb") as file:
            file.write(seconds.to_bytes(8, sys.byteorder, signed=True))

    @property
    def off(self) -> float:
        """By how much (s) the wall clock of a program is off."""
        code = "import time; print(time.time())"
        found = subprocess.run(
            [sys.executable, "-c", code], env=self.environment, capture_output=True, text=True
        )
        return float(found.stdout) - time.time()


@pytest.mark.skipif(shutil.which("cc") is None, reason="no compiler for a wall clock that jumps")
def test_11_the_wall_clock_may_jump(tmp_path: Path) -> None:
    clock = WallClock(tmp_path)
    for jump in JUMPS:
        clock.jump(jump)
        assert abs(clock.off - jump) < 3600
    clock.jump(0)
    with Bench(tmp_path, "--stop-time", "7 s", env=clock.environment) as bench:
        bench.flies(2.5)
        for jump in JUMPS:
            clock.jump(jump)
            bench.flies(bench.time + 0.8)
        code, out, told = bench.ended()
        bench.left_safe()
    no_trace(told)
    log = bench.log
    assert log.complete and (code == 0) == ("PASSED: 3 of 3" in out)
    assert 6.0 < (log.end or 0.0) <= 7.0
    for name, task in (("imu_line.gyro", "target/imu"), ("craft/imu.gyro", "world/imu")):
        times, missed = log.times(name), log[f"_times/{task}.overruns"][-1]
        assert (np.diff(times) > 0.005).all() and abs(len(times) + missed - 1 - times[-1] / 0.01) <= 1
    # Stamps, ages and lateness of times that are days away would be seen.
    assert 0.0 < log["supervision/news.instant"][-1] < 7.0
    assert np.abs(log["imu_line.age"]).max() < 7.0 and np.abs(log["pictures.age"]).max() < 7.0
    assert log["_times/target/imu.lateness"].max() <= 0.01


def test_17_a_second_program_at_the_same_ports_is_refused_and_the_first_one_flies_on(tmp_path: Path) -> None:
    with Bench(tmp_path) as bench:
        bench.flies(1.0)
        command = [sys.executable, "-m", "quadvis", "run", "bench.yaml", "--real-time", "--log", ""]
        rival = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=PATIENCE)
        assert rival.returncode == 1
        assert (
            f"block 'outputs': port '{bench.rc.near}' is in use by another program; end that one first"
            in rival.stderr
        )
        no_trace(rival.stderr)
        before = bench.commands
        bench.flies(bench.time + 0.5)
        assert bench.commands > before
        bench.send(signal.SIGTERM)
        assert bench.ended()[0] == 143
        bench.left_safe()


def test_18_a_flight_needs_no_reader_and_no_more_descriptors_or_memory_than_it_has(tmp_path: Path) -> None:
    reader, writer = pipe_that_nobody_reads()
    try:
        with (
            open("/dev/full", "w", encoding="utf-8") as full,
            Bench(tmp_path, "--stop-time", "5 s", stdout=full, stderr=writer) as bench,
        ):
            bench.flies(1.5)
            for process in [bench.process.pid, *bench.members]:
                no_more(process)
            # It may fail for memory before its end, and then nobody sends any more.
            wait_for(lambda: bench.time >= 4.9 or any(map(gone, bench.members)), PATIENCE)
            said = bytearray()  # its last sentence waits for us
            wait_for(lambda: said.extend(drained(reader)) or bench.has_ended, PATIENCE)
            assert bench.process.wait(PATIENCE) == 1  # what it has found cannot be printed
            bench.left_safe()
            assert bench.commands > 50
    finally:
        os.close(reader)
        os.close(writer)
    log, told = bench.log, said.decode()
    no_trace(told)
    # All is in the log, unless memory has failed, and then that is said.
    assert (log.complete and 4.0 < (log.end or 0.0) <= 5.0) or MEMORY in told, told.strip("x")


def pipe_that_nobody_reads() -> tuple[int, int]:
    """Return the two ends of a pipe that has no room left."""
    reader, writer = os.pipe()
    os.set_blocking(writer, False)
    with pytest.raises(BlockingIOError):
        while True:
            os.write(writer, b"x" * 64)
    os.set_blocking(writer, True)
    os.set_blocking(reader, False)
    return reader, writer


def drained(reader: int) -> bytes:
    """Read what is in a pipe."""
    with suppress(BlockingIOError):
        return os.read(reader, 1 << 16)
    return b""


def no_more(process: int) -> None:
    """Let a process have no more descriptors and no more memory than it has."""
    held = len(list(Path(f"/proc/{process}/fd").iterdir()))
    resource.prlimit(process, resource.RLIMIT_NOFILE, (held, held))
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[0])
    size = pages * resource.getpagesize()
    resource.prlimit(process, resource.RLIMIT_AS, (size, size))


OPEN = "the system refused: too many open files"
LIMITS = {
    "--nofile=12": (2, OPEN),
    "--nofile=30": (2, OPEN),
    # Where it is missed first depends on what is compiled already; LLVM gives up without asking anybody.
    "--as=400000000": (1, f"{re.escape(MEMORY)}|the system refused: .*|the application of .* SIGABRT"),
}


@pytest.mark.parametrize("limit", LIMITS)
def test_18_where_a_flight_cannot_begin_it_is_refused_in_a_sentence(limit: str, tmp_path: Path) -> None:
    wanted, words = LIMITS[limit]
    with Bench(tmp_path, "--stop-time", "2.5 s", before=["prlimit", limit]) as bench:
        code, _, told = bench.ended()
    assert code == wanted and re.search(f"^(.*: )?({words})$", told, re.MULTILINE), told
    no_trace(told)
    assert not bench.commands
