"""A camera that is open: OpenCV's capture within time limits, its pictures as they came, and their stamps."""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis_vision.capture.devices import is_driver, is_file, is_url, named, stamps_start
from quadvis_vision.capture.request import RATE, CameraRequest
from quadvis_vision.pictures.drawing import is_picture
from quadvis_vision.pictures.formats import FormatFault, layout

if TYPE_CHECKING:
    from numpy.typing import NDArray

OPEN, READ = 1.0, 1.0  # s that the calls may take for a stream
OPEN_DRIVER, READ_DRIVER = 3.0, 2.0  # and for a driver: the first picture takes its time
SLOWEST = 3  # periods of a slow camera that a read may take
MARGIN = 0.4  # s by which a call may pass its own time limit
OLDEST = 1_000_000_000  # ns: a driver's stamp that is older than that, or ahead, is of another clock
SECOND = 1_000_000_000
JPEG = int.from_bytes(b"MJPG", "little")
BUFFERS = 2  # of a driver


class NoPicture(Exception):
    """A camera that cannot be opened, or gives no picture: the text is a sentence."""


class Unusable(Exception):
    """A picture that is refused: the text says why."""


class WrongSize(Unusable):
    """A picture of another size, and so are surely those that follow."""


@dataclass(frozen=True)
class TakenPicture:
    """What a camera gave: bytes of a JPEG or pixels, and the middle of its exposure (ns, monotonic clock)."""

    raw: Any
    instant: int


class CameraSource:
    """An open camera. ``note`` says in words what it is, and where its stamps come from.

    JPEG comes as its bytes, since decoders make a picture of half a one: they fill it up with the one before.
    """

    def __init__(self, request: CameraRequest, calling: Callable[[float], None]) -> None:
        import cv2

        self._request, self._calling = request, calling
        self._device = device = request.device
        self.by_driver = is_driver(device)
        self.paced = not self.by_driver and is_file(device)
        if not (is_url(device) or os.path.exists(device)):
            raise NoPicture(f"{named(device)} is missing")
        opening, reading = (OPEN_DRIVER, READ_DRIVER) if self.by_driver else (OPEN, READ)
        self.read_limit = max(reading, SLOWEST / request.rate if request.rate else 0.0)
        limits = [
            *(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, round(opening * 1e3)),
            *(cv2.CAP_PROP_READ_TIMEOUT_MSEC, round(self.read_limit * 1e3)),
        ]
        calling(opening + MARGIN)
        if self.by_driver:
            self.capture = cv2.VideoCapture(os.path.realpath(device), cv2.CAP_V4L2)
        else:
            self.capture = cv2.VideoCapture(device, cv2.CAP_FFMPEG, limits)
        if not self.capture.isOpened():
            raise NoPicture(f"{named(device)} does not answer, or is no camera")
        self.back_end = self.capture.getBackendName()
        self._set_up()
        self.raw = self._ask_for_jpeg()
        self._starts = self.by_driver and stamps_start(device)
        self._stamped: bool | None = None
        self._due = 0.0
        rate = self.capture.get(cv2.CAP_PROP_FPS)
        self.rate = request.rate or (rate if 0 < rate <= 1000 else RATE)

    def _set_up(self) -> None:
        """Ask a driver for few buffers and the size; a stream cannot be asked."""
        import cv2

        if not self.by_driver:
            self.capture.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
            return
        self._calling(OPEN_DRIVER + MARGIN)
        self.capture.set(cv2.CAP_PROP_BUFFERSIZE, BUFFERS)
        if self._request.size:
            self.capture.set(cv2.CAP_PROP_FRAME_WIDTH, self._request.size[0])
            self.capture.set(cv2.CAP_PROP_FRAME_HEIGHT, self._request.size[1])

    def _ask_for_jpeg(self) -> bool:
        """Ask for the bytes of JPEG, if the camera gives JPEG; return whether it does."""
        import cv2

        if int(self.capture.get(cv2.CAP_PROP_FOURCC)) != JPEG or self.paced:
            return False
        if self.by_driver:
            return bool(self.capture.set(cv2.CAP_PROP_CONVERT_RGB, 0))
        return bool(self.capture.set(cv2.CAP_PROP_FORMAT, -1))

    @property
    def note(self) -> str:
        """What the camera is, and where its stamps come from, once a picture has been taken."""
        end = "start" if self._starts else "end"
        clock = f"by the driver, at the {end} of the exposure" if self._stamped else "by the read"
        return f"{named(self._device)} by {self.back_end}, {self.rate:.3g} pictures a second, stamped {clock}"

    def take(self) -> TakenPicture:
        """Take the next picture as it comes; NoPicture if none comes in time."""
        self._pace()
        self._calling(self.read_limit + MARGIN)
        found = self.capture.grab()
        now = time.monotonic_ns()
        if not found:
            raise NoPicture(f"{named(self._device)} gives no pictures any more")
        instant = self._instant(now)
        found, raw = self.capture.retrieve()
        return TakenPicture(raw if found else None, instant)

    def _pace(self) -> None:
        """Let the pictures of a file come at their rate."""
        if not self.paced:
            return
        now = time.monotonic()
        self._due = max(self._due + 1 / self.rate, now)
        self._calling(self._due - now + MARGIN)
        time.sleep(self._due - now)

    def _instant(self, now: int) -> int:
        """Return the middle of the exposure of the picture that was grabbed (ns)."""
        import cv2

        half = round((self._request.exposure or 0.0) / 2 * SECOND)
        stamp = round(self.capture.get(cv2.CAP_PROP_POS_MSEC) * 1e6) if self.by_driver else 0
        self._stamped = self.by_driver and 0 <= now - stamp < OLDEST
        if not self._stamped:
            return now - half - round(self._request.delay * SECOND)
        return stamp + half if self._starts else stamp - half

    def close(self) -> None:
        """Release the camera."""
        self.capture.release()


def decoded(raw: Any, size: tuple[int, int] | None, jpeg: bool) -> NDArray[np.uint8]:
    """Return the pixels of what a camera gave; Unusable if it is no whole picture of this size."""
    if raw is None:
        raise Unusable("a picture could not be decoded")
    if jpeg:
        raw = _of_jpeg(raw, size)
    if not is_picture(raw):
        raise Unusable("what came is no colour picture")
    _check_size(raw.shape[1::-1], size)
    return raw


def _of_jpeg(raw: Any, size: tuple[int, int] | None) -> Any:
    import cv2

    try:
        found = layout(raw.tobytes())
    except FormatFault as fault:
        raise Unusable(f"what came {str(fault).partition(';')[0]}") from None
    _check_size((found.width, found.height), size)
    try:
        return cv2.imdecode(
            np.frombuffer(found.coded, np.uint8), cv2.IMREAD_COLOR | cv2.IMREAD_IGNORE_ORIENTATION
        )
    except cv2.error:
        raise Unusable("a JPEG is damaged") from None


def _check_size(found: tuple[int, int], size: tuple[int, int] | None) -> None:
    if size is not None and found != size:
        raise WrongSize(
            f"pictures are {found[0]} x {found[1]} px, not {size[0]} x {size[1]} px; "
            "set the camera, or take the calibration of this one"
        )
