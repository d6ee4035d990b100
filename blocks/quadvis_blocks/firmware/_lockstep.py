"""The library that lets the firmware's clock go with the steps of a run: compiled when it is needed."""

from __future__ import annotations

import os
import shutil
import subprocess
from pathlib import Path

from quadvis.errors import sentence
from quadvis.machine.files import reason
from quadvis_blocks.firmware._connection import FirmwareError
from quadvis_blocks.firmware._sitl import STATE

SOURCE = Path(__file__).with_name("_lockstep.c")
COMPILERS = ("cc", "gcc", "clang")
PATIENCE = 60.0  # s
NANOSECONDS = 1e9


def in_lockstep(program: str, folder: Path, step: float, port: int) -> list[str]:
    """Return the command that runs a program by a clock with steps (s), whose ends go to a port.

    What it needs is compiled into the folder. FirmwareError if that cannot be.
    """
    compiler = os.environ.get("CC") or next(filter(shutil.which, COMPILERS), "")
    if not compiler:
        problem = "the clock of the firmware needs a C compiler, and there is none"
        raise FirmwareError(sentence(problem, "install gcc, for example"))
    library = folder / "lockstep.so"
    options = ("-O2", "-shared", "-fPIC", "-o", str(library), str(SOURCE), "-ldl", "-lpthread")
    try:
        made = subprocess.run([compiler, *options], capture_output=True, text=True, timeout=PATIENCE)
    except (OSError, subprocess.TimeoutExpired) as error:
        why = reason(error) if isinstance(error, OSError) else "it does not end"
        raise FirmwareError(f"the C compiler {compiler} does not run: {why}") from error
    if made.returncode:
        said = (made.stderr.strip().splitlines() or ["it does not say why"])[0]
        raise FirmwareError(f"the C compiler {compiler} refuses the clock of the firmware: {said}")
    settings = {
        "LD_PRELOAD": str(library),
        "QUADVIS_STEP": str(round(step * NANOSECONDS)),
        "QUADVIS_PORT": str(port),
        "QUADVIS_STATE": str(STATE.size),
    }
    return ["/usr/bin/env", *(f"{name}={value}" for name, value in settings.items()), program]
