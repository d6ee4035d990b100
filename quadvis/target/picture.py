"""Pictures of the application for people, as JPEG."""

from __future__ import annotations

import threading
import time
from typing import TYPE_CHECKING, Any

from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.realtime.pictures import Picture, picture_signals

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.realtime.helm import Helm

WAIT = 1.0  # s for the first picture of a signal
LOOK = 0.02
QUALITY = 80


def picture_names(diagram: Diagram) -> list[str]:
    """Return the names of the signals that are pictures."""
    return [f"{path}.{port}" for path, port in picture_signals(diagram.graph)]


def encoded(diagram: Diagram, helm: Helm, signal: str) -> dict[str, Any]:
    """Return the newest picture of a signal: ``format``, ``data``, ``width``, ``height``, ``sequence``.

    ``time`` is that of its tick, ``stamp`` the middle of its exposure (s, run time), ``began`` that of tick 0
    (ns since 1970, UTC). QuadvisError if the signal is no picture, or if none comes in time.
    """
    names = picture_names(diagram)
    wanted = diagram.ports.get(signal, signal)
    if wanted not in names:
        problem = f"{quoted(signal)} is no signal with pictures"
        there = f"there is {', '.join(names) or 'none'}"
        raise QuadvisError(sentence(problem, suggestion(signal, names) or there))
    path, _, port = wanted.rpartition(".")
    until = time.monotonic() + WAIT
    while (found := helm.picture(path, port)) is None:
        if time.monotonic() > until:
            raise QuadvisError(f"no picture of {quoted(signal)} has come")
        time.sleep(LOOK)
    height, width = found.pixels.shape[:2]
    return {
        "format": "jpeg", "data": _jpeg(found), "width": width, "height": height, "sequence": found.sequence,
        "time": float(found.tick * diagram.graph.tick), "stamp": found.stamp, "began": helm.began,
    }  # fmt: skip


def _jpeg(picture: Picture) -> bytes:
    with _IMPORT:
        import cv2
    done, data = cv2.imencode(".jpg", picture.pixels, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    if not done:
        raise QuadvisError("the picture cannot be written as JPEG")
    return bytes(data.tobytes())


_IMPORT = threading.Lock()  # of a large library, which two threads must not begin at once
