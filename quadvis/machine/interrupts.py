"""Signals that end a program: they raise an exception, so that every block and file is closed.

SIGTERM asks for an end, SIGHUP reports that the terminal has closed. A program that was started with one of
them ignored, as by nohup, goes on.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress

ENDS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))
KEYS = {signal.SIGINT, *ENDS} - {signal.SIGTERM}  # sent by a terminal to all its processes


def end_orderly() -> None:
    """Let these signals raise SystemExit with the exit code 128 + number from now on."""
    with suppress(ValueError):  # signals belong to the main thread
        for number in ENDS:
            if signal.getsignal(number) is not signal.SIG_IGN:
                signal.signal(number, _end)


def _end(number: int, _: object) -> None:
    for each in ENDS:  # terminals send a second signal, which would interrupt the closing
        signal.signal(each, signal.SIG_IGN)
    raise SystemExit(128 + number)


def leave_to_parent() -> None:
    """Ignore the terminal's signals: the parent process receives them and ends this process."""
    with suppress(ValueError):
        for number in KEYS:
            signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_SETMASK, ())


@contextmanager
def held_back() -> Iterator[None]:
    """Delay the terminal's signals; processes begun inside ignore them until `leave_to_parent`."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, KEYS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
