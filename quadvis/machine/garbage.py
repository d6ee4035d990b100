"""Python's garbage collector at rest: a large diagram has many objects, and none of them is garbage."""

from __future__ import annotations

import atexit
import gc
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def uncollected() -> Iterator[None]:
    """Collect no garbage inside; each collection would look at all objects made so far."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def collected_from_now_on() -> None:
    """Collect garbage again if the collector has been at rest, but never among the objects made by now."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()


def uncollected_at_exit() -> None:
    """Collect no garbage when the process ends: Python would look at all objects twice, for some 40 ms."""
    atexit.register(gc.freeze)
