"""What an analysis is doing just now, for whoever watches; nobody does unless asked."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Watcher = Callable[[str], None]

_watcher: ContextVar[Watcher | None] = ContextVar("watcher", default=None)
_task: ContextVar[str] = ContextVar("task", default="")


@contextmanager
def watched(watcher: Watcher) -> Iterator[None]:
    """Have the watcher called with what is being done, often."""
    token = _watcher.set(watcher)
    try:
        yield
    finally:
        _watcher.reset(token)


@contextmanager
def task(name: str) -> Iterator[None]:
    """Name what the steps inside are done for, after what that itself is done for."""
    token = _task.set(_joined(name))
    try:
        yield
    finally:
        _task.reset(token)


def tell(step: str) -> None:
    """Say what is being done."""
    watcher = _watcher.get()
    if watcher is not None:
        watcher(_joined(step))


def _joined(name: str) -> str:
    return ": ".join(filter(None, (_task.get(), name)))
