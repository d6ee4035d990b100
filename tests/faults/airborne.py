"""The hover in the air, `diagrams/flight.yaml` in its variant flight, with stand-ins for its devices."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

from quadvis.output.log_reader import Log, read_log
from tests.diagrams.stand_in_world import DIAGRAMS, World
from tests.faults.bench import LASTING, PATIENCE
from tests.processes import children, gone, wait_for

TEXT = """\
quadvis: 1
name: airborne
base: {{file: {flight}, variant: flight}}
overload: {overload}
params: {{circles_out: "", circles_in: ""}}
without: {{summary: [xy, h, yaw]}}
log: {{}}
expect:
  - {{signal: supervision.mode, after: 2 s, below: 3}}  # AUTOMATIC: nothing was missing
"""


class Airborne:
    """A flight by the command `quadvis run` in a stand-in world, as long as its context."""

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.world = World(folder)
        self.log_path = folder / "flight.mcap"
        self._folder, self._arguments = folder, arguments
        self.members: list[int] = []

    def __enter__(self) -> Airborne:
        world = self.world.__enter__()
        path = self._folder / "airborne.yaml"
        path.write_text(TEXT.format(flight=DIAGRAMS / "flight.yaml", overload=LASTING))
        ports = {"camera": world.camera, "imu": world.imu, "rc": world.rc, "eyes.exposure": "0 s"}
        settings = [text for name, value in ports.items() for text in ("--set", f"{name}={value}")]
        command = ["run", str(path), "--real-time", "--log", str(self.log_path), *settings, *self._arguments]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "quadvis", *command], text=True, stdout=subprocess.PIPE,
            stderr=subprocess.PIPE, start_new_session=True,
        )  # fmt: skip
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGKILL)
            self.process.wait()
        for stream in (self.process.stdout, self.process.stderr):
            assert stream is not None
            stream.close()
        self.world.__exit__()

    def flies(self) -> None:
        """Wait until the craft is in the air."""
        wait_for(lambda: self.world.positions or self.process.poll() is not None, PATIENCE)
        assert self.world.positions, self.process.communicate()
        self.members = children(self.process)

    def lasts(self, seconds: float) -> None:
        """Let it fly on; the time of the run is that of the monotonic clock."""
        time.sleep(seconds)
        assert self.process.poll() is None, self.process.communicate()

    def ended(self) -> tuple[int, str, str]:
        """Wait for the end of all its processes; return the exit code, and both texts that it has said."""
        out, err = self.process.communicate(timeout=PATIENCE)
        wait_for(lambda: all(map(gone, self.members)), PATIENCE)
        return self.process.returncode, out, err

    @property
    def log(self) -> Log:
        """The log."""
        return read_log(self.log_path)
