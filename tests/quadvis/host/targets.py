"""A target as a process of its own, for tests: no state of this user is touched."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from tests.processes import wait_for

ROOT = Path(__file__).resolve().parents[3]

# A loop that costs nothing, and that no load on the machine can end.
LOOP = """\
quadvis: 1
name: loop
rates: {fast: 100 Hz, slow: 20 Hz}
stop_time: 600 s
overload: {max: 1000000, consecutive: 1000000, action: warn}
params: {size: 2}
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: 1 m, frequency: 1 Hz}}
  law: {block: signal.gain, rate: slow, in: {u: {from: wave.y, across: sample}}, with: {factor: $size}}
  other: {block: signal.gain, rate: slow, in: {u: {from: wave.y, across: sample}}, with: {factor: 1}}
expect:
  - {signal: law.y, within: 100 m}
"""


class Running(NamedTuple):
    """A target that runs: its name, its process, its folder, the environment of its hosts."""

    name: str
    process: subprocess.Popen[str]
    folder: Path
    environment: Mapping[str, str]

    @property
    def output(self) -> str:
        """What it has said."""
        return (self.folder / "output.txt").read_text()


@contextmanager
def running_target(
    *arguments: str,
    name: str = "lab",
    home: Path | None = None,
    before: Sequence[str] = (),
    screen: int | None = None,
) -> Iterator[Running]:
    """Start a target; end it at the end, whatever happened.

    ``before`` is what starts its command, ``screen`` a terminal for its standard output.
    """
    folder = Path(tempfile.mkdtemp(prefix="q"))  # short: the path of a socket has an end
    environment = os.environ | {
        "QUADVIS_HOME": str(home or folder / "home"), "XDG_RUNTIME_DIR": str(folder),
        "XDG_STATE_HOME": str(folder / "state"),
        "PYTHONPATH": os.pathsep.join(map(str, (ROOT, ROOT / "blocks"))),
    }  # fmt: skip
    with (folder / "output.txt").open("w") as output:
        process = subprocess.Popen(
            [*before, sys.executable, "-m", "quadvis", "target", "--name", name, *arguments], env=environment,
            text=True, stdin=subprocess.DEVNULL, stdout=output if screen is None else screen, stderr=output,
            start_new_session=True,
        )  # fmt: skip
    try:
        last = "hosts with keys" if "--listen" in arguments else "this machine's user"
        wait_for(lambda: last in (folder / "output.txt").read_text() or process.poll() is not None)
        yield Running(name, process, folder, environment)
    finally:
        process.terminate()
        try:
            process.wait(20)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()
        shutil.rmtree(folder, ignore_errors=True)
