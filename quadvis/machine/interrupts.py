"""Signals that end a program: they raise an exception, so that every block and file is closed.

SIGTERM asks for an end, SIGHUP reports that the terminal has closed. A program that was started with one of
them ignored, as by nohup, goes on.
"""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

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
    """Delay the terminal's signals; processes begun inside ignore them until `leave_to_parent`.

    A signal that this thread blocks is taken by another one, and its handler then runs here all the same. So
    the handlers wait, too, as with `put_off`.
    """
    with put_off():
        before = signal.pthread_sigmask(signal.SIG_BLOCK, KEYS)
        try:
            yield
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def put_off(at_once: Callable[[], None] | None = None) -> Iterator[None]:
    """Let what the handlers of signals do wait for the end of the block; in the main thread only.

    ``at_once`` is called when a signal comes.
    """
    late: list[int] = []

    def note(number: int, _: object) -> None:
        late.append(number)
        if at_once is not None:
            at_once()

    handlers = _replaced(note)
    try:
        yield
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)
        for number in late[:1]:
            signal.raise_signal(number)


def _replaced(handler: Callable[[int, FrameType | None], None]) -> dict[int, Any]:
    """Let a handler take the place of Python's; return those that were there. None in other threads."""
    if threading.current_thread() is not threading.main_thread():
        return {}
    found = {number: signal.getsignal(number) for number in {signal.SIGINT, *ENDS}}
    return {number: signal.signal(number, handler) for number in found if callable(found[number])}
