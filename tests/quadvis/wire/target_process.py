"""A target in a process of its own, for tests: `python -m tests.quadvis.wire.target_process FOLDER KEY...`.

It lets in the keys with the levels 0, 1, ...; `startscope` publishes 1000 packages of 4 KiB, one each ms.
It ends with its standard input.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Mapping
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import numpy as np

from quadvis.wire.hosts import AuthorizedHosts, allow
from quadvis.wire.keys import new_key
from quadvis.wire.server import Server
from quadvis.wire.who import Who
from tests.quadvis.wire.rig import Echo

PACKAGES = 1000
SAMPLES = np.zeros((64, 8))


class Scopes(Echo):
    """The echo, which also publishes."""

    server: Server

    def __call__(self, verb: str, args: Mapping[str, Any], who: Who) -> Any:
        self.calls.clear()
        if verb != "startscope":
            return super().__call__(verb, args, who)
        done: Future[None] = Future()
        threading.Thread(target=self.publish, args=(done,), daemon=True).start()
        return done

    def publish(self, done: Future[None]) -> None:
        for _ in range(PACKAGES):
            self.server.publish("scope/1", {}, SAMPLES)
            time.sleep(0.001)
        done.set_result(None)


def main(folder: Path, *keys: str) -> None:
    pair, _ = new_key("lab1", folder)
    for level, key in enumerate(keys):
        allow(f"host{level}", key, level, (), folder)
    echo = Scopes()
    with Server("lab1", echo, hosts=AuthorizedHosts(folder), pair=pair) as server:
        echo.server = server
        port = server.listen("127.0.0.1", 0)
        server.start()
        print(port, pair.public.hex(), flush=True)
        sys.stdin.read()


if __name__ == "__main__":
    main(Path(sys.argv[1]), *sys.argv[2:])
