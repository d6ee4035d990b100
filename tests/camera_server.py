"""A camera of the network for tests: JPEGs over HTTP on loopback, each picture with its number painted in."""

from __future__ import annotations

import http.server
import threading
import time
from collections.abc import Callable
from typing import Any

import cv2
import numpy as np

SIZE = (96, 64)  # px
BITS = 12
BOUNDARY = b"picture"
Make = Callable[[int], bytes]


def painted(number: int, size: tuple[int, int] = SIZE) -> np.ndarray[Any, Any]:
    """Return a picture (height, width, 3) that shows a number: a column for each bit, bright for 1."""
    width, height = size
    bits = np.array([230 if number >> bit & 1 else 25 for bit in range(BITS)], np.uint8)
    return np.ascontiguousarray(
        np.broadcast_to(bits[np.arange(width) * BITS // width, None], (height, width, 3))
    )


def shown(pixels: np.ndarray[Any, Any]) -> int:
    """Return the number that a picture shows; -1 if its upper and its lower half do not agree."""
    halves = np.array_split(pixels, 2)
    columns = [[part.mean() > 128 for part in np.array_split(half, BITS, axis=1)] for half in halves]
    found = {sum(1 << bit for bit, bright in enumerate(half) if bright) for half in columns}
    return found.pop() if len(found) == 1 else -1


def jpeg(number: int, size: tuple[int, int] = SIZE) -> bytes:
    """Return a numbered picture as JPEG."""
    return coded(painted(number, size))


def coded(pixels: np.ndarray[Any, Any]) -> bytes:
    """Return pixels as JPEG."""
    return bytes(cv2.imencode(".jpg", pixels)[1].tobytes())


def part(data: bytes) -> bytes:
    """Return a picture as one part of a stream of pictures."""
    head = b"--%s\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % (BOUNDARY, len(data))
    return head + data + b"\r\n"


class CameraServer:
    """The camera: ``make`` gives the bytes of each picture by its number, which counts on through all calls.

    ``stalled`` lets it be silent with the connection open, ``deaf`` take calls and never answer; `hang_up`
    ends the connections, and while ``gone`` it takes no calls.
    """

    def __init__(self, make: Make = jpeg, period: float = 0.04) -> None:
        self.make, self.period = make, period
        self.sent = self.calls = 0
        self.stalled = self.deaf = self.gone = False
        self._generation = 0
        self._lock = threading.Lock()

    def hang_up(self) -> None:
        """End all connections."""
        self._generation += 1

    @property
    def url(self) -> str:
        """Where it is."""
        return f"http://127.0.0.1:{self._server.server_address[1]}/"

    def __enter__(self) -> CameraServer:
        camera = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def log_message(self, *_: object) -> None:
                pass

            def do_GET(self) -> None:
                camera._serve(self)

        self._server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self._server.daemon_threads = True
        threading.Thread(target=self._server.serve_forever, args=(0.05,), daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        self.gone = True
        self.hang_up()
        self._server.shutdown()
        self._server.server_close()

    def _serve(self, call: http.server.BaseHTTPRequestHandler) -> None:
        generation = self._generation
        with self._lock:
            self.calls += 1
        if self.gone:
            return
        while self.deaf and generation == self._generation:
            time.sleep(0.01)
        try:
            call.send_response(200)
            call.send_header("Content-Type", "multipart/x-mixed-replace; boundary=" + BOUNDARY.decode())
            call.end_headers()
            while generation == self._generation:
                time.sleep(self.period)
                if not self.stalled:
                    self._send(call.wfile)
        except OSError:
            pass  # whoever called has ended

    def _send(self, out: Any) -> None:
        with self._lock:
            number, self.sent = self.sent, self.sent + 1
        out.write(part(self.make(number)))
        out.flush()
