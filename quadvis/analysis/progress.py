"""The present step of an analysis, reported to a watcher if one is set."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Watcher = Callable[[str], None]

_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)
_task: ContextVar[str] = ContextVar("task", default="")


@contextmanager
def watched(watcher: Watcher) -> Iterator[None]:
    """Call the watcher with each step that begins inside."""
    token = _watcher.set(watcher)
    try:
        yield
    finally:
        _watcher.reset(token)


@contextmanager
def task(name: str) -> Iterator[None]:
    """Name the purpose of the steps inside; it follows the purposes around it."""
    token = _task.set(_joined(name))
    try:
        yield
    finally:
        _task.reset(token)


def announce(step: str) -> None:
    """Report the step that begins."""
    watcher = _watcher.get()
    if watcher is not None:
        watcher(_joined(step))


def _joined(name: str) -> str:
    return ": ".join(filter(None, (_task.get(), name)))
