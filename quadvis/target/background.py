"""Work that takes long, beside the thread that answers the verbs."""

from __future__ import annotations

import threading
from collections.abc import Callable
from concurrent.futures import Future
from typing import Any


def in_thread(work: Callable[[], Any]) -> Future[Any]:
    """Return what some work gives, or its exception, done in a thread of its own."""
    found: Future[Any] = Future()

    def perform() -> None:
        try:
            found.set_result(work())
        except Exception as error:
            found.set_exception(error)

    threading.Thread(target=perform, daemon=True).start()
    return found
