"""The least that pushing numbers to a browser costs in Python: a timer, JSON, and a websocket, and no target.

Run as a program it serves one client: `bare_push.py RATE NUMBERS` prints the address.
"""

from __future__ import annotations

import asyncio
import json
import subprocess
import sys
import time
from typing import Any


async def _serve(rate: float, numbers: int) -> None:
    from websockets.asyncio.server import serve

    async def talk(socket: Any) -> None:
        due = time.monotonic()
        while True:
            due += 1 / rate
            await asyncio.sleep(max(0.0, due - time.monotonic()))
            await socket.send(json.dumps({f"signal{n}": due + n for n in range(numbers)}))

    async with serve(talk, "127.0.0.1", 0, compression=None) as server:
        print(f"ws://127.0.0.1:{next(iter(server.sockets)).getsockname()[1]}", flush=True)
        await asyncio.Event().wait()


def bare_push(rate: float, numbers: int, seconds: float) -> float:
    """Return the part of a core that pushing takes, so many messages a second of so many numbers."""
    from websockets.sync.client import connect

    from benchmarks.page import processor_time

    words = [sys.executable, __file__, str(rate), str(numbers)]
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            with connect(process.stdout.readline().strip(), compression=None, proxy=None) as line:
                line.recv(20)
                before, began = processor_time(process.pid), time.monotonic()
                while time.monotonic() - began < seconds:
                    line.recv(20)
                return (processor_time(process.pid) - before) / (time.monotonic() - began)
        finally:
            process.terminate()


if __name__ == "__main__":
    asyncio.run(_serve(float(sys.argv[1]), int(sys.argv[2])))
