"""The keeper of a companion: a script that starts another program, and ends it when its own reader ends.

    python -I -S companion_keeper.py PRIORITY FOLDER LOG PROGRAM [ARGUMENT ...]

It runs the program until that ends, or until standard input closes, however the process at the other end has
ended; in that case FOLDER, if it is not "", is removed. It never returns while the program lives; if the
keeper is killed, Linux kills the program. The exit code is that of the program.
"""

from __future__ import annotations

import ctypes
import os
import select
import shutil
import signal
import sys
from contextlib import suppress

PR_SET_PDEATHSIG, PR_SET_TIMERSLACK = 1, 29
CANNOT_START = 127


def main(priority: int, folder: str, log: str, *command: str) -> int:
    """Run a program for as long as somebody holds the other end of standard input."""
    with suppress(OSError):  # what a loop that starts us has for itself
        os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
        os.sched_setaffinity(0, range(os.cpu_count() or 1))
    keeper = os.getpid()
    program = os.fork()
    if program == 0:
        _become(keeper, priority, log, command)
    life = os.pidfd_open(program)
    ready = select.select([life, sys.stdin.fileno()], [], [])[0]
    if life not in ready:
        os.kill(program, signal.SIGKILL)
    status = os.waitpid(program, 0)[1]
    if life not in ready and folder:
        shutil.rmtree(folder, ignore_errors=True)
    return os.waitstatus_to_exitcode(status) & 0xFF


def _become(keeper: int, priority: int, log: str, command: tuple[str, ...]) -> None:
    """Be the program."""
    try:
        library = ctypes.CDLL(None)
        library.prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != keeper:
            os._exit(0)
        library.prctl(PR_SET_TIMERSLACK, 1, 0, 0, 0)  # ns; otherwise short sleeps take 50 us more
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.dup2(os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), 1)
        os.dup2(1, 2)
        if priority:
            with suppress(OSError):
                os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        os.execv(command[0], command)
    except BaseException as error:
        os.write(2, f"{error}\n".encode())
    os._exit(CANNOT_START)


if __name__ == "__main__":
    raise SystemExit(main(int(sys.argv[1]), *sys.argv[2:]))
