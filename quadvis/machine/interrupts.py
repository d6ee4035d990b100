"""Signals that end a program: it leaves by the door of an error, so that every block and file is closed.

SIGTERM asks for an end, SIGHUP tells that the terminal is gone. Whoever starts a program with one of them
ignored, as nohup does, wants it to go on.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress

ENDS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
KEYS = {signal.SIGINT, *ENDS} - {signal.SIGTERM}  # what a terminal sends to all processes that it started


def end_orderly() -> None:
    """Let these signals raise SystemExit with the exit code 128 + number from now on."""
    with suppress(ValueError):  # signals belong to the main thread
        for number in ENDS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, _end)


def _end(number: int, _: object) -> None:
    for each in ENDS:  # a second one, as terminals send, would tear what is being closed
        signal.signal(each, signal.SIG_IGN)
    raise SystemExit(128 + number)


def leave_to_parent() -> None:
    """Be deaf to the terminal: the process that started this one hears it, and ends this one."""
    with suppress(ValueError):
        for number in KEYS:
            signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())


@contextmanager
def held_back() -> Iterator[None]:
    """Put off what a terminal sends; processes begun inside are deaf to it until `leave_to_parent`."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, KEYS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
