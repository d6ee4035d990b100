"""What is wanted of a camera, as plain data that goes to the process which reads it."""

from __future__ import annotations

from dataclasses import dataclass

from quadvis.machine.capture import CaptureRequest
from quadvis_vision.capture.pixels import HEADER

WORK = "quadvis_vision.capture.worker:work"
ROOM = 1920 * 1080 * 3  # bytes of a picture whose size is not known before
RATE = 30.0  # 1/s, of a camera that does not say its rate


@dataclass(frozen=True)
class CameraRequest:
    """A camera and its settings; ``device`` is a path, a number, a URL, or the path of a file or FIFO.

    ``size`` (width, height; px) is what its pictures must have, or None for any. ``rate`` (1/s, 0: any),
    ``exposure`` (s), ``gain`` (in the driver's numbers) and ``white_balance`` (K) are set if they are not
    None. ``delay`` (s) is the time from the end of the exposure to the read, where the driver gives no stamp.
    """

    device: str
    size: tuple[int, int] | None = None
    rate: float = 0.0
    exposure: float | None = None
    gain: float | None = None
    white_balance: float | None = None
    delay: float = 0.0

    def capture(self) -> CaptureRequest:
        """Return what is to be captured."""
        room = self.size[0] * self.size[1] * 3 if self.size else ROOM
        return CaptureRequest(WORK, self, room + HEADER)
