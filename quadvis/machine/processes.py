"""Processes of quadvis's own beside the first one.

They are spawned: each begins as a fresh interpreter, so that nothing of the first process (locks, threads of
libraries, an earlier diagram) leaks into it.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from types import ModuleType

from quadvis.machine.interrupts import held_back

# Where processes share the processors, threads inside one of them only wait for each other. The limits must
# be set before numpy is imported.
ONE_THREAD = dict.fromkeys(
    (
        "MKL_NUM_THREADS",
        "NUMBA_NUM_THREADS",
        "OMP_NUM_THREADS",
        "OPENBLAS_NUM_THREADS",
        "OPENCV_FOR_THREADS_NUM",
        "VECLIB_MAXIMUM_THREADS",
    ),
    "1",
)


@contextmanager
def launching() -> Iterator[None]:
    """Start processes with one thread for each library, without the terminal's signals and the main script.

    The processes do not need the script, so a script works without `if __name__ == "__main__":`.
    """
    with held_back():  # Python's own helper process must survive the terminal, too
        resource_tracker.ensure_running()
    environment = {name: os.environ.get(name) for name in ONE_THREAD}
    main = sys.modules["__main__"]
    os.environ.update(ONE_THREAD)
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        with held_back():
            yield
    finally:
        sys.modules["__main__"] = main
        for name, value in environment.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
