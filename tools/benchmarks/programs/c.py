"""C by hand, compiled by gcc each time."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

from benchmarks.tasks import FACTOR, START, STEP, SUBSTEPS, Task, Values, reached

# gcc's vectors of the 12 states wait for stores that are not through: scalar code is twice as fast.
FLAGS = ("-O3", "-march=native", "-fno-tree-vectorize", "-shared", "-fPIC")


def load() -> str:
    """Return the version of gcc; ImportError if there is none."""
    if shutil.which("gcc") is None:
        raise ImportError("gcc is not installed")
    return "gcc " + subprocess.run(["gcc", "-dumpversion"], capture_output=True, text=True).stdout.strip()


def build(task: Task) -> Callable[[int], Callable[[], Values]]:
    """Compile, and call by ctypes."""
    with tempfile.TemporaryDirectory() as folder:
        library = Path(folder, "by_hand.so")
        source = Path(__file__).with_name("by_hand.c")
        subprocess.run(["gcc", *FLAGS, source, "-o", library, "-lm"], check=True)
        functions = ctypes.CDLL(str(library))
    step, factor = ctypes.c_double(STEP), ctypes.c_double(FACTOR)

    def prepare(steps: int) -> Callable[[], Values]:
        values = (ctypes.c_double * 12)(*START)
        if task.letter == "a":
            functions.hybrid.restype = None
            return lambda: (
                functions.hybrid(values, ctypes.c_long(steps), ctypes.c_long(SUBSTEPS), step) or values
            )
        if task.letter == "b":
            functions.discrete.restype = None
            return lambda: functions.discrete(values, ctypes.c_long(steps), step) or values
        half = task.count // 2
        delays = (ctypes.c_double * half)()
        functions.chain.restype = None

        def run() -> Values:
            functions.chain(delays, ctypes.c_long(half), ctypes.c_long(steps), factor)
            return [delays[index] for index in reached(task.count, steps)]

        return run

    return prepare
