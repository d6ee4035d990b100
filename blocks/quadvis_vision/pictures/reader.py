"""The only reader of pictures: it returns the pixels of the sensor, or says in one sentence why it cannot.

A calibration holds for pixels as the sensor gave them. So the reader ignores the orientation that a file may
ask for, bytes after the end of the picture, transparency, and colour profiles. Where colours are wanted, grey
becomes three equal channels; of 16 bits the upper 8 count. A picture that is cut short is refused, because a
decoder would invent the missing pixels.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.machine.inputs import open_input, read_input
from quadvis_vision.camera.picture_size import BOUND, is_too_large
from quadvis_vision.pictures.formats import FormatFault, layout

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Pixels = NDArray[np.uint8]

SUFFIXES = (".bmp", ".jpeg", ".jpg", ".png")  # files in a folder with other suffixes are no pictures


@dataclass(frozen=True, eq=False)
class CodedPicture:
    """A picture that is read but not decoded: it is whole, and its size (width, height) is known.

    `turned` says that the file asks viewers to turn or mirror the picture; `decode` does not do it.
    """

    path: str
    size: tuple[int, int]
    turned: bool
    data: bytes

    def decode(self, *, grey: bool = False) -> Pixels:
        """Return (height, width, 3) blue-green-red, or (height, width) in grey; QuadvisError if damaged."""
        import cv2

        flags = cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR
        picture: Any = None
        try:
            coded = np.frombuffer(self.data, dtype=np.uint8)
            picture = cv2.imdecode(coded, flags | cv2.IMREAD_IGNORE_ORIENTATION)
        except cv2.error:
            pass
        if picture is None or picture.shape[1::-1] != self.size or picture.dtype != np.uint8:
            raise QuadvisError(
                f"{self.path} is damaged, or coded in a way that is not read here; save it as PNG"
            )
        return np.asarray(picture, dtype=np.uint8)


def read_coded(path: str | Path) -> CodedPicture:
    """Read a picture's file and its header; QuadvisError, in one sentence with the path, if it is unusable.

    This takes memory for the bytes of the file only, not for the size of the picture that they declare.
    """
    name = os.fspath(path)
    data = read_input(name)
    try:
        found = layout(data)
    except FormatFault as fault:
        raise QuadvisError(f"{name} {fault}") from None
    size = found.width, found.height
    if min(size) < 1:
        raise QuadvisError(f"{name} declares {size[0]} x {size[1]} px; give a picture with pixels")
    if is_too_large(size):
        raise QuadvisError(f"{name} declares {size[0]} x {size[1]} px; {BOUND}")
    return CodedPicture(name, size, found.turned, found.coded)


def turned_note(pictures: Iterable[CodedPicture]) -> list[str]:
    """Return one note about all files that ask viewers to turn them; [] if no file does."""
    names = [Path(picture.path).name for picture in pictures if picture.turned]
    if not names:
        return []
    asks = "asks" if len(names) == 1 else "ask"
    return [
        f"{', '.join(names)} {asks} to be turned or mirrored (orientation tag); the pixels are taken as the "
        "sensor gave them"
    ]


def open_video(path: str | Path) -> Any:
    """Return OpenCV's capture of a video; its frames, too, come as the sensor gave them.

    QuadvisError if the file does not exist, is not a video, or has frames that are too large.
    """
    import cv2

    open_input(path).close()  # neither a folder nor a pipe
    video = cv2.VideoCapture(os.fspath(path))
    video.set(cv2.CAP_PROP_ORIENTATION_AUTO, 0)
    size = int(video.get(cv2.CAP_PROP_FRAME_WIDTH)), int(video.get(cv2.CAP_PROP_FRAME_HEIGHT))
    if not video.isOpened() or size[0] * size[1] <= 0 or is_too_large(size):
        video.release()
        raise not_a_video(path)
    return video


def not_a_video(path: str | Path) -> QuadvisError:
    """Return the error for a file that is not a video."""
    return QuadvisError(f"'{path}' is not a video that OpenCV can read; convert it, e.g. to mp4")
