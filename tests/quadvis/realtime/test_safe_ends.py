"""Every end of a real-time run leaves safe frames on its output ports, and none of its processes alive."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

import quadvis
from quadvis.errors import RunError
from quadvis_blocks.hardware.sbus_out import SbusOut
from tests.processes import children, gone, wait_for
from tests.quadvis.realtime.ptys import Pty, ptys
from tests.stages import mostly_slow

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="real time is Linux's")

TEXT = """\
quadvis: 1
name: flight
rates: {fast: 50 Hz}
stop_time: 1000 s
overload: {max: 1000000, consecutive: MISSED, startup: 1}
on_host_loss: LOSS
blocks:
  stick: {block: own.stick, rate: fast}
  out:
    block: hardware.sbus_out
    rate: fast
    with: {port: PORT, channels: [1], lowest: [0], highest: [1], initial: [0.5], safe: [0]}
    in: {command: stick.y}
"""
OWN = '''
"""A stick at its highest end, until a file 'go' is there."""

import os
import time as clock
from pathlib import Path

from quadvis.block import Block, Out


class Stick(Block, numeric=False):
    """Writes the number of its process into the file 'process'."""

    y = Out("float64[1]")

    def open(self):
        Path("process").write_text(str(os.getpid()))

    def output(self):
        if Path("go").exists():
            ...
        return [1.0]
'''
DEVICE = SbusOut(port="pty:x", channels=[1], lowest=[0.0], highest=[1.0], initial=[0.5], safe=[0.0])
INITIAL, SAFE, GOING = DEVICE.initial_frame(), DEVICE.safe_frame(), DEVICE.frame(np.ones(1))


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    monkeypatch.chdir(tmp_path)
    yield tmp_path


@pytest.fixture
def pty() -> Iterator[Pty]:
    with ptys(1) as (made,):
        yield made


def write(port: str, at: str = "pass", missed: int = 1_000_000, loss: str = "safe") -> None:
    text = TEXT.replace("PORT", f'"{port}"').replace("MISSED", str(missed)).replace("LOSS", loss)
    Path("flight.yaml").write_text(text)
    Path("blocks/own").mkdir(parents=True)
    Path("blocks/own/stick.py").write_text(OWN.replace("            ...\n", f"            {at}\n"))


class Flight:
    """A real-time run in a process of its own, whose commands have come to the port."""

    def __init__(self, pty: Pty) -> None:
        self.pty = pty
        command = [sys.executable, "-m", "quadvis", "run", "flight.yaml", "--real-time", "--priority", "0"]
        self.process = subprocess.Popen(
            [*command, "--poll", "0", "--log", ""],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        wait_for(lambda: self.process.poll() is not None or pty.read().endswith(2 * GOING))
        assert self.process.poll() is None, self.process.communicate()
        self.application = int(Path("process").read_text())
        self.all = children(self.process)
        (self.guardian,) = set(self.all) - {self.application}

    def ended(self) -> tuple[int, str]:
        """Wait for the end of all processes; return the exit code and what was said last."""
        _, told = self.process.communicate(timeout=60)
        wait_for(lambda: all(map(gone, self.all)))
        return self.process.returncode, told.splitlines()[-1] if told else ""

    def check(self) -> None:
        """Check what has come to the port: initial frames, commands, then safe frames and nothing else."""
        wire = self.pty.read()
        frames = [wire[at : at + 25] for at in range(0, len(wire), 25)]
        kinds = {INITIAL: "initial", GOING: "going", SAFE: "safe"}
        order = [kinds[frame] for frame in frames]
        assert order == sorted(order, key=["initial", "going", "safe"].index)
        assert order[-3:] == ["safe"] * 3


def go(_: Flight) -> None:
    Path("go").touch()


def send(number: signal.Signals, to: str) -> Callable[[Flight], None]:
    def send_it(flight: Flight) -> None:
        os.kill(flight.process.pid if to == "command" else getattr(flight, to), number)

    send_it.__name__ = f"{number.name}_{to}"
    return send_it


SILENT = r"t = \S+ s: the loop has given no sign of life for 0\.14 s"
KILLED = r"t = \S+ s: the application was killed by SIGKILL"
ENDS = [
    (send(signal.SIGKILL, "application"), "pass", 1, KILLED),
    (
        go,
        "raise ValueError('no such luck')",
        1,
        r"block 'stick', t = \S+ s: ValueError: no such luck in .*stick\.py:\d+",
    ),
    (go, "os._exit(3)", 1, r"t = \S+ s: the application has ended with exit code 3"),
    (go, "clock.sleep(100)", 1, f"block 'stick', {SILENT}"),
    (send(signal.SIGSTOP, "application"), "pass", 1, SILENT),
    (send(signal.SIGTERM, "application"), "pass", 1, r"t = \S+ s: the application was told to end"),
    (send(signal.SIGINT, "command"), "pass", 130, "interrupted"),
    (send(signal.SIGTERM, "command"), "pass", 143, ".*"),
    (send(signal.SIGHUP, "command"), "pass", 129, ".*"),
    (send(signal.SIGKILL, "command"), "pass", -9, ".*"),
    (send(signal.SIGTERM, "guardian"), "pass", 1, r"t = \S+ s: the guardian was told to end"),
    (send(signal.SIGABRT, "guardian"), "pass", 1, r"t = \S+ s: the guardian was told to end"),
]


@pytest.mark.parametrize(
    ("end", "at", "code", "words"),
    mostly_slow(ENDS),
    ids=lambda value: getattr(value, "__name__", None),
)
def test_every_end_leaves_safe_frames_on_the_wire(
    pty: Pty, end: Callable[[Flight], None], at: str, code: int, words: str
) -> None:
    write(pty.path, at, missed=5 if SILENT in words else 1_000_000)
    flight = Flight(pty)
    end(flight)
    ended = flight.ended()
    flight.check()
    assert ended[0] == code, ended
    assert re.search(f"(?:^|: ){words}$", ended[1]), ended[1]


@pytest.mark.slow
def test_the_stop_time_leaves_safe_frames_on_the_wire(pty: Pty) -> None:
    write(pty.path)
    diagram = quadvis.load("flight.yaml", stop_time="0.5 s")
    result = diagram.run(real_time=quadvis.RealTime(priority=0, poll="0 s"))
    assert result.passed
    flight = Flight.__new__(Flight)
    flight.pty = pty
    flight.check()


@pytest.mark.slow
def test_a_guardian_that_is_killed_ends_the_run_and_the_supervisor_takes_its_place(pty: Pty) -> None:
    write(pty.path)
    flight = Flight(pty)
    os.kill(flight.guardian, signal.SIGKILL)
    code, told = flight.ended()
    assert (code, told.endswith("the guardian of the outputs has been lost")) == (1, True), told
    assert pty.read().endswith(SAFE)


@pytest.mark.slow
def test_a_port_that_is_unplugged_ends_the_run_with_its_name(pty: Pty) -> None:
    write(pty.path)
    flight = Flight(pty)
    pty.unplug()
    code, told = flight.ended()
    assert code == 1
    assert f"{pty.path}: the port is gone: input/output error" in told
    assert "block 'out'" in told


@pytest.mark.slow
def test_a_run_that_may_lose_its_host_goes_on_and_is_safe_at_its_own_end(pty: Pty) -> None:
    write(pty.path, loss="continue")
    flight = Flight(pty)
    os.kill(flight.process.pid, signal.SIGKILL)
    flight.process.wait()  # the others still hold its pipes
    seen = len(pty.read())
    wait_for(lambda: len(pty.read()) > seen + 50 * 25)
    assert pty.read().endswith(GOING)
    os.kill(flight.application, signal.SIGTERM)
    flight.ended()
    flight.check()


@pytest.mark.slow
@pytest.mark.parametrize("loss", ["stop", "safe"])
def test_a_loop_that_hangs_is_made_safe_though_the_host_is_lost(pty: Pty, loss: str) -> None:
    write(pty.path, "clock.sleep(100)", missed=5, loss=loss)
    flight = Flight(pty)
    Path("go").touch()
    os.kill(flight.process.pid, signal.SIGKILL)
    flight.ended()
    flight.check()


@pytest.mark.slow
def test_a_port_that_is_taken_or_missing_ends_the_run_before_it_begins(pty: Pty) -> None:
    write(pty.path)
    flight = Flight(pty)
    wishes = quadvis.RealTime(priority=0, poll="0 s")
    with pytest.raises(RunError) as caught:
        quadvis.load("flight.yaml").run(real_time=wishes)
    words = f"block 'out': port '{pty.path}' is in use by another program; end that one first"
    assert str(caught.value) == words
    assert flight.process.poll() is None
    os.kill(flight.process.pid, signal.SIGINT)
    flight.ended()
    flight.check()
    missing = quadvis.load("flight.yaml", settings=["out.port=/dev/none"])
    with pytest.raises(
        RunError, match="block 'out': port '/dev/none' is missing; plug the device in, or give"
    ):
        missing.run(real_time=wishes)


@pytest.mark.slow
def test_a_cable_brings_the_commands_to_an_input() -> None:
    write("pty:rc")
    more = (
        '  back: {block: hardware.sbus_in, rate: fast, with: {port: "pty:rc", channels: [1], lowest: [0], '
        "highest: [1], roles: stick}}\n"
    )
    Path("flight.yaml").write_text(Path("flight.yaml").read_text() + more)
    result = quadvis.load("flight.yaml", stop_time="1 s").run(
        real_time=quadvis.RealTime(priority=0, poll="0 s")
    )
    read = result["back.command"].ravel()
    seen = read[~np.isnan(read)]
    assert seen[-1] == 1.0
    assert set(np.round(seen, 3)) <= {0.5, 1.0}
    assert result["back.refused"][-1] == 0


TWO = """\
quadvis: 1
name: two
rates: {fast: 50 Hz, slow: 4 Hz}
stop_time: 0.7 s
overload: {max: 1000000}
computers: {target: {}, world: {}}
blocks:
  stick: {block: own.stick, rate: fast, at: target}
  out:
    block: hardware.sbus_out
    rate: fast
    at: target
    with: {port: "pty:rc", channels: [1], lowest: [0], highest: [1], initial: [0.5], safe: [0]}
    in: {command: stick.y}
  wave: {block: sources.sine, rate: slow, at: world}
  back:
    block: hardware.sbus_in
    rate: fast
    at: target
    with: {port: "pty:rc", channels: [1], lowest: [0], highest: [1], roles: stick}
"""


@pytest.mark.slow
def test_a_computer_whose_last_tick_is_earlier_leaves_the_outputs_to_the_others() -> None:
    write("pty:rc")
    Path("flight.yaml").write_text(TWO)
    result = quadvis.load("flight.yaml").run(real_time=quadvis.RealTime(priority=0, poll="0 s"))
    read = result["back.command"].ravel()
    assert read[~np.isnan(read)][-1] == 1.0  # 0.2 s after the last tick of the other one


SEEING = """\
quadvis: 1
name: seeing
rates: {fast: 50 Hz}
stop_time: 1000 s
overload: {max: 1000000, consecutive: 50, startup: 1}
computers: {target: {}, eyes: {on_loss: continue}}
blocks:
  seer: {block: own.seer, rate: fast, at: eyes}
  stick: {block: own.stick, rate: fast, at: target}
  out:
    block: hardware.sbus_out
    rate: fast
    at: target
    with: {port: PORT, channels: [1], lowest: [0], highest: [1], initial: [0.5], safe: [0]}
    in: {command: stick.y}
"""


@pytest.mark.slow
@pytest.mark.parametrize("how", ["SIGKILL", "SIGSTOP", "fails"])
def test_a_computer_that_others_can_do_without_is_lost_and_they_go_on(pty: Pty, how: str) -> None:
    write(pty.path)
    Path("flight.yaml").write_text(SEEING.replace("PORT", f'"{pty.path}"'))
    seer = OWN.replace("class Stick", "class Seer").replace("'process'", "'seer'")
    seer = seer.replace('"process"', '"seer"').replace("            ...\n", "            raise ValueError\n")
    Path("blocks/own/seer.py").write_text(seer)
    flight = Flight.__new__(Flight)
    flight.pty = pty
    command = [sys.executable, "-m", "quadvis", "run", "flight.yaml", "--real-time", "--priority", "0"]
    flight.process = subprocess.Popen(
        [*command, "--poll", "0", "--log", "run.mcap"],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True,
    )  # fmt: skip
    wait_for(lambda: flight.process.poll() is not None or pty.read().endswith(2 * GOING))
    eyes, flight.application = int(Path("seer").read_text()), int(Path("process").read_text())
    flight.all = children(flight.process)
    if how == "fails":
        Path("go").touch()
    else:
        os.kill(eyes, getattr(signal, how))
    wait_for(lambda: gone(eyes))
    seen = len(pty.read())
    wait_for(lambda: len(pty.read()) > seen + 50 * 25)
    assert SAFE not in pty.read()
    os.kill(flight.application, signal.SIGKILL)
    _, told = flight.process.communicate(timeout=60)
    wait_for(lambda: all(map(gone, flight.all)))
    flight.check()
    assert flight.process.returncode == 1
    words = {"SIGKILL": "was killed by SIGKILL", "SIGSTOP": "no sign of life", "fails": "ValueError"}[how]
    assert re.search(f"{words}.*; the other computers fly on without 'eyes'", told), told
    assert "the application of 'target' was killed by SIGKILL" in told
