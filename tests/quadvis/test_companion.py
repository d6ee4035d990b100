"""A program that runs beside a process: its words, its exit code, and its end with the process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from quadvis.machine.companion import Companion
from quadvis.machine.companion_keeper import CANNOT_START
from tests.processes import gone, linux, wait_for

pytestmark = linux
STARTS = """
import sys, time
from pathlib import Path
from quadvis.machine.companion import Companion
Companion(["/bin/sh", "-c", "echo $$ > pid; exec sleep 600"], Path(sys.argv[1]), removes=True)
time.sleep(600)
"""


def started(folder: Path, script: str) -> Companion:
    return Companion(["/bin/sh", "-c", script], folder)


def number(folder: Path) -> int:
    """Return the process of a program that writes its number into its folder."""
    return int(wait_for(lambda: (folder / "pid").exists() and (folder / "pid").read_text().strip()))


def test_its_exit_code_and_its_last_words_are_known(tmp_path: Path) -> None:
    companion = started(tmp_path, "echo first; echo; echo '  the gyro is gone ' >&2; echo; exit 7")
    assert companion.wait(60.0) and companion.code == 7
    assert companion.last_words == "the gyro is gone"
    companion.end()


def test_a_program_that_cannot_start_says_why(tmp_path: Path) -> None:
    companion = Companion([str(tmp_path / "no such program")], tmp_path)
    assert companion.wait(60.0) and companion.code == CANNOT_START
    assert "No such file" in companion.last_words
    companion.end()


def test_it_ends_when_it_is_let_go_and_keeps_its_folder(tmp_path: Path) -> None:
    companion = Companion(["/bin/sh", "-c", "echo $$ > pid; trap '' TERM; exec sleep 600"], tmp_path)
    program = number(tmp_path)
    assert companion.code is None and not companion.wait(0.0) and companion.last_words == ""
    companion.end()
    assert gone(program) and companion.code is not None and tmp_path.is_dir()


@pytest.mark.slow
@pytest.mark.parametrize("number_of_signal", [signal.SIGKILL, signal.SIGTERM])
def test_it_ends_with_its_process_and_then_its_folder_goes(
    number_of_signal: signal.Signals, tmp_path: Path
) -> None:
    folder = tmp_path / "folder"
    folder.mkdir()
    process = subprocess.Popen([sys.executable, "-c", STARTS, str(folder)])
    program = number(folder)
    os.kill(process.pid, number_of_signal)
    process.wait()
    wait_for(lambda: gone(program) and not folder.exists())


@pytest.mark.slow
def test_it_ends_with_its_keeper(tmp_path: Path) -> None:
    companion = started(tmp_path, "echo $$ > pid; exec sleep 600")
    program = number(tmp_path)
    os.kill(companion._process.pid, signal.SIGKILL)
    wait_for(lambda: gone(program))
    companion.end()
