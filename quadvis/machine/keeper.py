"""The keeper of a capture: the process that begins its worker, and begins it anew when a call hangs.

The keeper has one thread and never calls the device, so it can fork its workers at once: a worker needs no
second import of the libraries. It ends with its reader, whose death closes a pipe. A worker ends with its
keeper: Linux kills it.
"""

from __future__ import annotations

import ctypes
import os
import select
import signal
import time
from collections.abc import Callable
from importlib import import_module
from multiprocessing import parent_process
from typing import Any, NoReturn

from quadvis.machine.capture import DEADLINE, OPENING, RESTARTS, CaptureRequest, Post
from quadvis.machine.interrupts import leave_to_parent

LOOK = 0.05  # s between two looks at a call
PAUSE = 0.2  # s before a worker that has ended is begun anew
BEGIN = 5.0  # s that a worker has for its own beginning
PR_SET_PDEATHSIG = 1
QUIET = {  # OpenCV and FFmpeg report each stall on the terminal, and wait for 10 s for a camera
    "OPENCV_LOG_LEVEL": "SILENT",
    "OPENCV_FFMPEG_LOGLEVEL": "-8",
    "OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT": "2",
}

Work = Callable[[Post, Any], None]


def keep(request: CaptureRequest, words: Any) -> None:
    """Be the keeper: the whole life of its process."""
    os.setsid()  # no terminal stops it (Ctrl-Z) or kills it
    leave_to_parent()
    signal.signal(signal.SIGTERM, _end)
    os.environ.update(QUIET)
    post, work = Post(words, request.room), _work(request.function)
    parent = parent_process()
    assert parent is not None
    while True:
        worker = _begin(work, post, request.about)
        try:
            orphaned = _watch(worker, post, parent.sentinel)
        finally:
            os.kill(worker, signal.SIGKILL)
            os.waitpid(worker, 0)
        if orphaned or select.select([parent.sentinel], [], [], PAUSE)[0]:
            return
        post.words[RESTARTS] += 1


def _end(number: int, _: object) -> NoReturn:
    raise SystemExit(128 + number)


def _work(function: str) -> Work:
    module, _, name = function.partition(":")
    found: Work = getattr(import_module(module), name)
    return found


def _begin(work: Work, post: Post, about: Any) -> int:
    """Fork a worker; return its process."""
    keeper = os.getpid()
    post.calling(BEGIN)
    worker = os.fork()
    if worker:
        return worker
    try:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() == keeper:
            null = os.open(os.devnull, os.O_RDWR)
            os.dup2(null, 1)
            os.dup2(null, 2)
            work(post, about)
    except BaseException as error:
        post.say(OPENING, f"{type(error).__name__}: {error}")
    finally:
        os._exit(0)


def _watch(worker: int, post: Post, reader: int) -> bool:
    """Wait until the worker ends or a call of it hangs; return whether the reader has ended before that."""
    life = os.pidfd_open(worker)
    try:
        while True:
            ready = select.select([life, reader], [], [], LOOK)[0]
            if ready:
                return reader in ready
            if time.monotonic_ns() > post.words[DEADLINE]:
                post.say(OPENING, "a call of the driver did not return, and was ended")
                return False
    finally:
        os.close(life)
