"""Serve the page of a target until Ctrl-C, and show it in a browser."""

from __future__ import annotations

import asyncio
import os
import tempfile
import webbrowser
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from quadvis.web.gateway import Gateway
from quadvis.web.viewed import ViewedTarget


def serve(target: ViewedTarget, port: int, browser: bool, say: Callable[[str], None]) -> None:
    """Serve until this thread is interrupted; QuadvisError if the port is taken. ``say`` takes sentences."""
    asyncio.run(_serve(target, port, browser, say))


async def _serve(target: ViewedTarget, port: int, browser: bool, say: Callable[[str], None]) -> None:
    with ExitStack() as stack:
        async with Gateway(target, say).serving(port) as gateway:
            say(f"the page of {target.name}: {gateway.address}")
            if browser:
                place = stack.enter_context(_leading_to(gateway.address))
                await asyncio.to_thread(webbrowser.open, place.as_uri())
            await asyncio.Event().wait()


@contextmanager
def _leading_to(address: str) -> Iterator[Path]:
    """Give a file that leads to an address: every user sees the arguments of a browser, and not this file."""
    number, name = tempfile.mkstemp(prefix="quadvis-", suffix=".html")
    with os.fdopen(number, "w", encoding="utf-8") as file:
        file.write(
            f'<!DOCTYPE html><meta http-equiv="refresh" content="0; url={address}"><title>quadvis</title>'
        )
    try:
        yield Path(name)
    finally:
        with suppress(OSError):
            Path(name).unlink()
