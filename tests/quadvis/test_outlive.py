"""A run survives its outputs: a log that the disk refuses, a terminal that nobody reads."""

from __future__ import annotations

import errno
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.output.log_reader import read_log

FLIGHT = """\
quadvis: 1
name: flight
rates: {fast: 1 kHz}
stop_time: 5 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 1 Hz, amplitude: 2 m}}
expect:
  - {signal: wave.y, within: 2 m}
  - {signal: wave.y, after: 4 s, at_least: 999}
summary:
  wave: {signal: wave.y, show: [rms, final]}
"""
ROWS = 5001
pytestmark = pytest.mark.skipif(os.name != "posix", reason="descriptors of a Unix")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "flight.yaml").write_text(FLIGHT)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def full_after(count: int, monkeypatch: pytest.MonkeyPatch, number: int = errno.ENOSPC) -> None:
    """Let the disk take so many bytes of a log, and refuse the rest."""
    left, write = [count], os.write

    def some(descriptor: int, data: Any) -> int:
        if not left[0]:
            raise OSError(number, os.strerror(number))
        taken = write(descriptor, data[: left[0]])
        left[0] -= taken
        return taken

    monkeypatch.setattr("quadvis.output.sink.os.write", some)


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EFBIG, errno.EIO, errno.EDQUOT, errno.ESTALE])
@pytest.mark.parametrize("room", [3_000, 70_001, 200_000])
def test_the_run_goes_on_without_its_log(
    room: int, number: int, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    full_after(room, monkeypatch, number)
    assert main(["run", "flight.yaml", "--log", "run.mcap"]) == 1
    out, err = capsys.readouterr()
    assert out.splitlines()[-2:] == ["PASSED: 2 of 2 expectations met", "log: run.mcap"]
    log = read_log("run.mcap")
    count = len(log["wave.y"]) if log.names else 0
    assert count < ROWS
    lost = (
        f"it lacks {ROWS - count} rows, the first of t = {count / 1000:g} s; the run itself is judged in full"
    )
    assert err == f"cannot write the log 'run.mcap': {os.strerror(number).lower()}; {lost}\n"


def test_what_was_lost_stands_in_the_json(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    full_after(70_000, monkeypatch)
    assert main(["run", "flight.yaml", "--log", "run.mcap", "--json"]) == 1
    facts = json.loads(capsys.readouterr().out)
    assert facts["passed"]
    assert facts["lost"].startswith("cannot write the log 'run.mcap': no space left on device; it lacks ")
    monkeypatch.undo()
    monkeypatch.chdir(folder)
    assert main(["run", "flight.yaml", "--log", "run.mcap", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["lost"] is None


def test_in_python_the_result_says_what_is_lost_and_hands_out_no_part_of_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    full_after(70_000, monkeypatch)
    diagram = quadvis.load("flight.yaml")
    result = diagram.run(log="run.mcap")
    assert result.passed
    assert "no space left on device" in result.lost
    with pytest.raises(QuadvisError, match="the rows of 'wave' were not kept, and cannot write the log"):
        result["wave.y"]
    monkeypatch.undo()
    full_after(70_000, monkeypatch)
    assert len(diagram.run(log=folder / "run.mcap", keep=["wave"])["wave.y"]) == ROWS


def test_a_full_disk_before_the_start_stops_the_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    full_after(100, monkeypatch)
    assert main(["run", "flight.yaml", "--log", "run.mcap"]) == 1
    assert "cannot write the log 'run.mcap': no space left on device\n" in capsys.readouterr().err


def test_a_limit_of_the_system_on_files_is_no_other_case(folder: Path) -> None:
    code = (
        "import resource, sys; from quadvis.cli import main;"
        "resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, -1)); sys.exit(main(sys.argv[1:]))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, "run", "flight.yaml", "--log", "run.mcap"],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 1
    assert "PASSED: 2 of 2" in done.stdout
    assert "it lacks " in done.stderr and len(done.stderr.splitlines()) == 1
    assert 0 < len(read_log("run.mcap")["wave.y"]) < ROWS


def test_a_row_of_a_sweep_whose_log_is_cut_does_not_pass_and_is_run_again(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("quadvis.sweeps.pool.processors", lambda: 1)
    full_after(90_000, monkeypatch)
    from quadvis.sweeps.worker import Configuration, Job, perform

    row = perform(Job(0, Configuration("flight.yaml"), log="run.mcap"))
    assert not row.passed
    assert row.failure.startswith("cannot write the log 'run.mcap'")
    assert len(row.numbers) == 4


def terminal_that_nobody_reads() -> tuple[int, int]:
    """Return the two ends of a terminal that has no room left."""
    reader, writer = os.openpty()
    os.set_blocking(writer, False)
    with pytest.raises(BlockingIOError):
        while True:
            os.write(writer, b"x" * 64)
    os.set_blocking(writer, True)
    return reader, writer


def test_a_terminal_that_nobody_reads_holds_up_no_run(folder: Path) -> None:
    reader, writer = terminal_that_nobody_reads()
    try:
        code = (
            "import quadvis.run.session as session, sys; session.SLICE = 0.0;"
            "from quadvis.cli import main; sys.exit(main())"
        )
        command = [sys.executable, "-c", code, "run", "flight.yaml", "--log", "run.mcap"]
        done = subprocess.run(command, stdout=subprocess.PIPE, stderr=writer, text=True, timeout=300)
    finally:
        os.close(reader)
        os.close(writer)
    assert done.returncode == 0
    assert "PASSED: 2 of 2" in done.stdout
    assert read_log("run.mcap").complete


def test_a_terminal_that_goes_away_ends_no_run(folder: Path) -> None:
    reader, writer = os.openpty()
    code = (
        "import os, quadvis.run.session, sys; quadvis.run.loops.SLICE = 0.0; from quadvis.cli import main;"
        "os.read(0, 1); sys.exit(main())"
    )
    command = [sys.executable, "-c", code, "run", "flight.yaml", "--log", "run.mcap"]
    child = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=writer, text=True)
    os.close(writer)
    os.close(reader)
    out, _ = child.communicate("x", timeout=300)
    assert child.returncode == 0
    assert "PASSED: 2 of 2" in out
    assert read_log("run.mcap").complete
