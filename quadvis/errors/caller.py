"""The caller, in whose words messages name what was given: options of a command, or arguments in Python."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

IS_COMMAND = ContextVar("the caller is a command", default=False)


def as_given(option: str, argument: str) -> str:
    """Return the words of the caller: ``as_given("--stop-time", "stop_time")``."""
    return option if IS_COMMAND.get() else argument


@contextmanager
def command_words() -> Iterator[None]:
    """Let messages name options."""
    token = IS_COMMAND.set(True)
    try:
        yield
    finally:
        IS_COMMAND.reset(token)
