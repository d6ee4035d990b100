"""Writes frames into a video file, to be watched or played again."""

from __future__ import annotations

from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from quadvis.block import Block, Frame, In, Param, ParameterError, State
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.files import Kind, check_output, open_output
from quadvis_vision.pictures.drawing import Picture, is_picture

CODECS = {".mp4": "mp4v", ".avi": "MJPG", ".mkv": "FFV1"}
HEADS = {".mp4": rb"\A[\s\S]{4}ftyp", ".avi": rb"\ARIFF[\s\S]{4}AVI ", ".mkv": rb"\A\x1aE\xdf\xa3"}
FINEST = 65535  # parts of a second: MPEG-4 cannot count time in finer parts
SMALLEST = 16  # px: Motion JPEG of pictures with a smaller side overruns its memory and ends the process


class VideoWriter(Block, numeric=False):
    """Writes frames into a video file; the first frame replaces an earlier video of that name.

    The suffix of the file chooses the format: ``.mp4`` is MPEG-4, small and readable everywhere; ``.avi`` is
    Motion JPEG, which codes every picture by itself; ``.mkv`` is FFV1 and keeps every bit.

    With `keep_time` one picture is written at each tick: black before the first frame, and the last frame
    again while no new frame comes. So a second of the video is a second of the run. Without `keep_time` every
    new frame is written once, so `vision.video_file` plays exactly these frames.

    All pictures of a video have the size of the first frame, made even by repeating the last row or column. A
    frame of another size is fitted into that size. A frame that is not a picture, or has a side below 16 px,
    is black. ParameterError if the file exists and is not a video, or if this run reads it; RunError if it
    cannot be written.
    """

    harmless = "a video moves nothing"

    frame = In("frame", doc="the frames to write")

    file = Param(
        type="file", writes=True, doc="video file: .mp4, .avi or .mkv; its folder is made if missing"
    )
    keep_time = Param(True, type="bool", doc="write a picture at each tick, also without a new frame")

    last = State("int64", 0)  # sequence number of the last frame
    due = State("int64", 0)  # pictures up to now; black pictures are due until a frame gives the size

    example = """
        pictures: {block: vision.image_folder, rate: slow, with: {folder: "quadvis:recordings/hand_held"}}
        writer:
          block: vision.video_writer
          rate: slow
          with: {file: runs/seen.avi}
          in: {frame: pictures.frame}
    """

    def check(self) -> None:
        """Refuse a folder in place of a file, and an unknown format."""
        if self._suffix not in CODECS:
            names = ", ".join(CODECS)
            raise ParameterError("file", f"file must end in one of {names}, got '{Path(self.file).name}'")
        if Path(self.file).is_dir():
            raise ParameterError("file", f"file must be a file, '{self.file}' is a folder")

    def open(self) -> None:
        """Make the folder; the first frame begins the file, because it gives the size."""
        self._video: Any = None
        self._held: Any = None  # the open file, so that no other run writes it
        self._picture: Picture | None = None
        try:
            Path(self.file).parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"cannot make the folder of '{self.file}': {error.strerror}") from error
        self.check_written()

    def check_written(self) -> None:
        """Refuse an existing file that is not a video."""
        if not Path(self.file).parent.is_dir():
            return
        try:
            check_output(self.file, self._kind)
        except QuadvisError as error:
            raise ParameterError("file", str(error)) from error

    def close(self) -> None:
        """Finish the file."""
        video = self.__dict__.get("_video")
        if video is not None:
            video.release()
        held = self.__dict__.get("_held")
        if held is not None:
            held.close()
        self._video = self._held = None

    def write(self, frame: Frame) -> None:
        """Write the frame of this tick."""
        new = self._is_new(frame)
        if new:
            if self._video is None and is_shown(frame.pixels):
                self._begin(frame.pixels)
            if self._video is not None:
                self._picture = fitted(frame.pixels, self._size)
        if (new or self.keep_time) and self._video is not None:
            self._video.write(self._picture)

    def update(self, frame: Frame) -> None:
        """Count the frame of this tick."""
        new = self._is_new(frame)
        if new:
            self.last = frame.sequence
        if new or self.keep_time:
            self.due += 1

    def _is_new(self, frame: Frame) -> bool:
        return frame.sequence not in (0, self.last)

    @property
    def _suffix(self) -> str:
        return Path(self.file).suffix.lower()

    @property
    def _kind(self) -> Kind:
        return Kind("the video", pattern=HEADS[self._suffix])

    def _begin(self, pixels: Picture) -> None:
        import cv2

        self._held = open_output(self.file, self._kind)
        height, width = pixels.shape[:2]
        self._size = (width + width % 2, height + height % 2)
        codec = cv2.VideoWriter.fourcc(*CODECS[self._suffix])
        video = cv2.VideoWriter(self.file, cv2.CAP_FFMPEG, codec, frame_rate(self.period), self._size)
        if not video.isOpened():
            size = f"{self._size[0]} x {self._size[1]} px"
            raise RunError(f"cannot write the video '{self.file}' of {size} at {1 / self.period:g} frames/s")
        self._video = video
        black = fitted(None, self._size)
        for _ in range(self.due):
            video.write(black)


def is_shown(pixels: object) -> TypeGuard[Picture]:
    """Return whether pixels are a picture that is large enough for a video."""
    return is_picture(pixels) and min(pixels.shape[:2]) >= SMALLEST


def frame_rate(period: float) -> float:
    """Return the frames/s for a period (s), rounded so that an MPEG-4 file can hold the number."""
    rates = (round(1 / period, digits) for digits in (3, 2, 1))
    fits = (rate for digits, rate in zip((3, 2, 1), rates, strict=True) if rate * 10**digits <= FINEST)
    return next(fits, float(round(1 / period)))


def fitted(pixels: object, size: tuple[int, int]) -> Picture:
    """Return a picture of this even width and height that shows `pixels`, scaled if necessary."""
    import cv2

    wide, high = size
    picture = np.zeros((high, wide, 3), np.uint8)
    if not is_shown(pixels):
        return picture
    source = np.ascontiguousarray(pixels)
    height, width = source.shape[:2]
    if (width + width % 2, height + height % 2) == size:
        border = (0, high - height, 0, wide - width)
        return np.asarray(cv2.copyMakeBorder(source, *border, cv2.BORDER_REPLICATE), dtype=np.uint8)
    scale = min(wide / width, high / height)
    width, height = max(1, round(width * scale)), max(1, round(height * scale))
    left, top = (wide - width) // 2, (high - height) // 2
    shown = cv2.resize(source, (width, height), interpolation=cv2.INTER_AREA)
    picture[top : top + height, left : left + width] = shown
    return picture
