"""The hover on the bench, `diagrams/flight.yaml` in its variant hil, with all its lines in the test's hands.

Commands go over SBUS, circles and inertial unit over the frames of links; each line is a `BadLine`. What
other programs do on the machine must not decide: ticks that are lost only count as overruns.
"""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Self

import numpy as np

from quadvis.links.frame import Decoder
from quadvis.machine.serial_port import Line
from quadvis.output.log_reader import Log, read_log
from quadvis_blocks.hardware._sbus import LENGTH, LINE
from quadvis_blocks.hardware.imu_in import message_of
from quadvis_blocks.hardware.sbus_out import SbusOut
from tests.faults.lines import BadLine, Lines
from tests.processes import children, gone, holder, wait_for

DIAGRAMS = Path(__file__).parents[2] / "diagrams"
FLIGHT = DIAGRAMS / "flight.yaml"
PATIENCE = 300.0  # s; whoever takes longer hangs: machine code may have to be compiled first
HOVER, IDLE, MOST = 1.22625, 0.2, 2.0  # N
CIRCLES, IMU = Line(115_200), Line(230_400)
RADIO = SbusOut(
    port="pty:any", channels=[1, 2, 3, 4], lowest=[0.0] * 4, highest=[MOST] * 4, initial=[HOVER] * 4,
    safe=[IDLE] * 4,
)  # fmt: skip
INITIAL, SAFE = RADIO.initial_frame(), RADIO.safe_frame()
# A loop that is held up for seconds by other programs goes on, and its outputs keep their values meanwhile.
LASTING = "{max: 1000000, consecutive: 1000}"
TEXT = """\
quadvis: 1
name: bench
base: {{file: {flight}, variant: hil}}
without: {{summary: [xy, h, yaw]}}
overload: {overload}
params: {{rc: {rc.near}}}
links:
  pictures: {{from: world, to: vision_pc, room: [322, 452]}}
  circle_line:
    {{from: vision_pc, to: target, via: serial,
     baud: 115200, port: {{from: {circles.near}, to: {circles.far}}}}}
  imu_line: {{from: world, to: target, via: serial, baud: 230400, port: {{from: {imu.near}, to: {imu.far}}}}}
blocks:
  receiver: {{part: {parts}/sbus_receiver.yaml, at: world, with: {{port: {rc.far}}}, in: {{initial: $hover}}}}
{blocks}
expect:
  - {{signal: supervision.mode, after: 2 s, below: 3}}  # AUTOMATIC: nothing was missing
  - {{signal: "craft.position[0:2]", within: 1 m}}
  - {{signal: "craft.position[2]", of: "$target[2]", within: 1 m}}
log: {{}}
{more}
"""


class BenchLines:
    """The three lines of the bench and its diagram, from the beginning of the context to its end.

    ``blocks`` are lines of the diagram that replace or add blocks, ``more`` is what else stands there,
    ``own`` the source of own blocks by the names of their files. ``rc``, ``circles`` and ``imu`` are the
    lines, ``diagram`` is its path.
    """

    def __init__(
        self,
        folder: Path,
        blocks: str = "",
        more: str = "",
        own: Mapping[str, str] | None = None,
        overload: str = LASTING,
    ) -> None:
        self.rc, self.circles, self.imu = BadLine(LINE), BadLine(CIRCLES), BadLine(IMU)
        self.diagram = folder / "bench.yaml"
        self._lines = ExitStack()
        for name, source in (own or {}).items():
            (folder / "blocks" / "own").mkdir(parents=True, exist_ok=True)
            (folder / "blocks" / "own" / f"{name}.py").write_text(source)
        parts = DIAGRAMS / "parts"
        given = {"flight": FLIGHT, "parts": parts, "overload": overload, "blocks": blocks, "more": more}
        lines = {"rc": self.rc, "circles": self.circles, "imu": self.imu}
        self.diagram.write_text(TEXT.format(**given, **lines))
        self._decoder = Decoder(message_of("craft/imu"))
        self._decoded, self._time = 0, 0.0

    def __enter__(self) -> Self:
        self._lines.enter_context(Lines([self.rc, self.circles, self.imu]))
        return self

    def __exit__(self, *_: object) -> None:
        self._lines.close()

    @property
    def time(self) -> float:
        """The time of the run (s): the newest stamp of the inertial unit."""
        sent = bytes(self.imu.sent[self._decoded :])
        for arrival in self._decoder.take(sent):
            self._time = arrival.stamp / 1e9
        self._decoded += len(sent)
        return self._time

    @property
    def frames(self) -> list[bytes]:
        """All whole frames that ever came from the radio's port."""
        sent = bytes(self.rc.sent)
        return [sent[at : at + LENGTH] for at in range(0, len(sent) - LENGTH + 1, LENGTH)]

    @property
    def commands(self) -> int:
        """The number of frames that are neither initial nor safe ones."""
        return sum(frame not in (INITIAL, SAFE) for frame in self.frames)

    def left_safe(self) -> None:
        """Check what came to the radio: initial frames, commands, then safe ones and nothing else."""
        frames = self.frames
        assert len(self.rc.sent) % LENGTH == 0, "the last frame is not whole"
        order = ["initial" if each == INITIAL else "safe" if each == SAFE else "going" for each in frames]
        assert order == sorted(order, key=["initial", "going", "safe"].index), order
        assert order[-1] == "safe", order[-1]


class Bench(BenchLines):
    """A flight of the bench by the command `quadvis run`, from the beginning of the context to its end.

    ``before`` are words before the command, ``made`` goes to `BenchLines`, ``started`` to the command.
    """

    def __init__(
        self,
        folder: Path,
        *arguments: str,
        log: Path | None = None,
        before: Sequence[str] = (),
        made: Mapping[str, Any] | None = None,
        **started: Any,
    ) -> None:
        super().__init__(folder, **(made or {}))
        self.log_path = folder / "flight.mcap" if log is None else log
        self._folder = folder
        self._command = [*before, sys.executable, "-m", "quadvis", "run", "bench.yaml", "--real-time"]
        self._command += ["--log", str(self.log_path), *arguments]
        self._started = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, **started}
        self.members: list[int] = []

    def __enter__(self) -> Self:
        super().__enter__()
        self.process = subprocess.Popen(
            self._command, cwd=self._folder, text=True, start_new_session=True, **self._started
        )
        return self

    def __exit__(self, *_: object) -> None:
        for process in [self.process.pid, *(self.members or children(self.process))]:
            if not gone(process):
                os.kill(process, signal.SIGKILL)
        self.process.wait()
        for stream in (self.process.stdout, self.process.stderr):
            if stream is not None:
                stream.close()
        super().__exit__()

    @property
    def has_ended(self) -> bool:
        """True if the command has ended."""
        return self.process.poll() is not None

    def flies(self, until: float = 0.5) -> Self:
        """Wait until it has commands on the line and flies for so long (s of its own time)."""
        wait_for(lambda: self.has_ended or (self.time >= until and self.commands), PATIENCE)
        assert not self.has_ended, self.process.communicate()
        self.members = self.members or children(self.process)
        return self

    def member(self, name: str) -> int:
        """Return the process of a computer, or the guardian: by the ports that it has."""
        ports = {
            "world": self.imu.near, "vision_pc": self.circles.near, "target": self.circles.far,
            "guardian": self.rc.near,
        }  # fmt: skip
        found = holder(ports[name], self.members)
        assert found, f"nobody has the port of {name}"
        return found

    def send(self, number: signal.Signals, name: str = "command") -> None:
        """Send a signal to the command, or to one of its processes."""
        os.kill(self.process.pid if name == "command" else self.member(name), number)

    def ended(self) -> tuple[int, str, str]:
        """Wait for the end of all its processes; return the exit code, and both texts that it has said."""
        out, err = self.process.communicate(timeout=PATIENCE)
        wait_for(lambda: all(map(gone, self.members)), PATIENCE)
        return self.process.returncode, out or "", err or ""

    @property
    def log(self) -> Log:
        """The log."""
        return read_log(self.log_path)


def no_trace(text: str) -> None:
    """Check that somebody was told in sentences."""
    assert "Traceback" not in text, text


def one_of(values: np.ndarray, given: np.ndarray) -> np.ndarray:
    """Return for each row of values whether it is one of the given rows, to the bit."""
    known = {row.tobytes() for row in np.ascontiguousarray(given)}
    return np.array([row.tobytes() in known for row in np.ascontiguousarray(values)], bool)
