"""The process that runs one FMU for another process: it does requests over shared memory, and nothing else.

    python -I -S -c '...main(...)' buffer asked answered life    (descriptors), the setup on standard input

in the folder of the unpacked copy.

If the FMU crashes, hangs or ends this process, the other one goes on. If the other one ends, however it does,
this process removes the unpacked copy and ends, even while the FMU hangs.
"""

from __future__ import annotations

import json
import mmap
import os
import shutil
import signal
import sys
import threading
from contextlib import suppress

from quadvis.fmi.exchange import ANSWERED, DATA, END, SLEEPS, SLOT, STATUS, UnitSetup
from quadvis.fmi.instance import FmuInstance

WHOLE = "}\n"  # the end of a setup


def main() -> None:
    """Be that process: its whole life."""
    buffer_file, asked, answered, life = map(int, sys.argv[1:5])
    folder = os.getcwd()
    end = threading.Thread(target=_end_with_caller, args=(life, folder), daemon=True)
    end.start()
    text = sys.stdin.read()
    if not text.endswith(WHOLE):
        end.join()  # the caller was killed while it wrote, and this process ends there
    setup = UnitSetup.read(json.loads(text))
    _keep_quiet()
    buffer = mmap.mmap(buffer_file, setup.size)
    instance = FmuInstance(setup, buffer, folder)
    asked_to_end = False
    with suppress(BrokenPipeError):
        asked_to_end = _answer(instance, buffer, asked, answered)
    if not asked_to_end:
        end.join()  # the caller has ended, and the copy is not removed yet
    os._exit(0)  # what the library has registered for the end has no say here


def _answer(instance: FmuInstance, buffer: mmap.mmap, asked: int, answered: int) -> bool:
    """Do one request after the other; return whether the last one was to end.

    A caller that sleeps is woken by a byte.
    """
    words = memoryview(buffer).cast("B")[:DATA].cast("q")
    count, sleeps, status = (place // SLOT for place in (ANSWERED, SLEEPS, STATUS))
    words[status] = instance.open()
    words[count] = 1
    os.write(answered, b"o")
    while request := os.read(asked, 1):
        if request[0] == END:
            instance.end()
            return True
        words[status] = instance.perform(request[0])
        words[count] += 1
        if words[sleeps]:
            os.write(answered, request)
    return False


def _keep_quiet() -> None:
    """Leave no dumps of memory, and take nothing from the terminal."""
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, 0)
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_IGN)
    with suppress(ImportError, OSError, ValueError):
        import resource

        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _end_with_caller(life: int, folder: str) -> None:
    """Wait until the other end of a pipe is closed, which its process does at the latest when it ends."""
    with suppress(OSError):
        os.read(life, 1)
    shutil.rmtree(folder, ignore_errors=True)
    os.kill(os.getpid(), signal.SIGKILL)
