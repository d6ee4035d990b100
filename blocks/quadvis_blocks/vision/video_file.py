"""Pictures from a video file, in place of a camera."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Block, Frame, Out, Param, ParameterError, State, Work
from quadvis.errors import QuadvisError
from quadvis_vision.pictures.drawing import is_picture
from quadvis_vision.pictures.reader import not_a_video, open_video


class VideoFile(Block, numeric=False):
    """Plays a video file in the order of its frames, one frame at each tick, at any frame rate of the file.

    Each frame is stamped with the time of its tick. The last frame stays on the wire with its stamp and
    sequence number, and `finished` is true; with `loop` the first frame follows the last, and the sequence
    numbers continue. A file that is cut short or damaged ends at its last readable frame.

    After a jump in time (a restored snapshot) the file is decoded again up to the frame: video libraries seek
    to different positions with different codecs, and replay must give the same bits.

    Source: section 6.1, the comparison of pose estimates on a video sequence.
    """

    frame = Out("frame", doc="the picture of this tick, or the last one")
    finished = Out("bool", doc="true when there is no frame left")

    file = Param(type="file", doc="video file, in any format that OpenCV reads")
    loop = Param(
        False,
        type="bool",
        doc="begin again after the last frame; detectors then need `repeats: news`",
    )

    played = State("int64", 0)  # frames that were on the wire
    stamp = State("float64")  # of the last frame
    at_end = Work("bool")

    example = """
        video: {block: vision.video_file, rate: slow, with: {file: "quadvis:recordings/hand_held.mp4"}}
    """

    def check(self) -> None:
        """Refuse a file that is missing or not a video."""
        if not Path(self.file).is_file():
            state = "is not a file" if Path(self.file).exists() else "does not exist"
            raise ParameterError("file", f"file '{self.file}' {state}; name a video file")
        video = _Video(self.file)
        try:
            video.begin()
        except QuadvisError as error:
            raise ParameterError("file", f"file {error}") from None
        finally:
            video.close()

    def open(self) -> None:
        """Open the file."""
        self._video = _Video(self.file)
        self._last = Frame.none()

    def close(self) -> None:
        """Close the file, if it could be opened."""
        if "_video" in self.__dict__:
            self._video.close()

    def read(self, time: float) -> None:
        """Read the frame of this tick."""
        pixels = self._video.frame(self.played, self.loop)
        self.at_end = pixels is None
        sequence, stamp = (self.played, self.stamp) if self.at_end else (self.played + 1, time)
        if pixels is None:
            pixels = self._video.frame(self.played - 1)
            assert pixels is not None
        if (self._last.sequence, self._last.stamp) != (sequence, stamp):
            self._last = Frame(pixels, stamp, sequence)

    def output(self) -> tuple[Frame, bool]:
        """Return the frame of this tick and whether the file is at its end."""
        return self._last, self.at_end

    def update(self, time: float) -> None:
        """Count the frame that was on the wire."""
        if not self.at_end:
            self.played += 1
            self.stamp = time


class _Video:
    """A video file by frame number: a result depends on the file and the number alone."""

    def __init__(self, path: str) -> None:
        self._path = path
        self._capture: Any = None
        self._next = 0  # the frame that the capture would read now
        self._length: int | None = None  # known after the end was reached
        self._kept: dict[int, NDArray[np.uint8]] = {}  # the last two frames: the end needs one of them again

    def begin(self) -> None:
        """Open the file and read its first frame; QuadvisError if it is not a video."""
        if self.frame(0) is None:
            raise not_a_video(self._path)

    def frame(self, number: int, loop: bool = False) -> NDArray[np.uint8] | None:
        """Return frame `number` from 0 (height, width, 3) BGR; None behind the end, unless `loop` is set."""
        if self._length is None and number not in self._kept:
            self._read(number)
        if self._length is not None:
            if self._length == 0 or (number >= self._length and not loop):
                return None
            number %= self._length
        if number not in self._kept:
            self._read(number)
        return self._kept.get(number)

    def _read(self, number: int) -> None:
        """Decode up to a frame and keep it; note the length if the end comes first."""
        if self._capture is None or number < self._next:
            self._open()
        while self._next < number and self._capture.grab():
            self._next += 1
        found, picture = self._capture.read() if self._next == number else (False, None)
        if not found:
            self._length = self._next
            return
        self._kept = {key: kept for key, kept in self._kept.items() if key == number - 1}
        self._kept[number] = np.asarray(picture) if is_picture(picture) else Frame.none().pixels
        self._next = number + 1

    def _open(self) -> None:
        self.close()
        self._capture = open_video(self._path)
        self._next = 0

    def close(self) -> None:
        """Release the file."""
        if self._capture is not None:
            self._capture.release()
        self._capture = None
