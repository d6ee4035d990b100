"""Frames into a folder, to be looked at or played again."""

from __future__ import annotations

from pathlib import Path

from quadvis.block import Block, Frame, In, Param, ParameterError, State
from quadvis.errors import RunError


class FrameWriter(Block, numeric=False):
    """Writes every new frame as a picture into a folder: ``000001.png``, ``000002.png``, ...

    The number is the frame's sequence number, so `vision.image_folder` plays them in order. Pictures of the
    same name are replaced; frames without pixels are passed over. RunError if one cannot be written.
    """

    frame = In("frame", doc="the frames to write")

    folder = Param(type="file", doc="folder, made if it is not there")
    format = Param("png", choices=("png", "jpg"), doc="png keeps every bit, jpg is some ten times smaller")
    every = Param(1, type="int64", min=1, doc="write one frame out of so many")

    written = State("int64", 0)  # sequence number of the last new frame
    seen = State("int64", 0)  # how many new frames there were

    def check(self) -> None:
        """Refuse a folder that is a file."""
        if Path(self.folder).is_file():
            raise ParameterError("folder", f"folder must be a folder, '{self.folder}' is a file")

    def open(self) -> None:
        """Make the folder."""
        try:
            Path(self.folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"cannot make the folder '{self.folder}': {error.strerror}") from error

    def update(self, frame: Frame) -> None:
        """Write a frame that is new."""
        if frame.sequence in (0, self.written):
            return
        self.written = frame.sequence
        self.seen += 1
        if (self.seen - 1) % self.every == 0 and frame.pixels.size:
            self._write(frame)

    def _write(self, frame: Frame) -> None:
        import cv2

        path = Path(self.folder) / f"{frame.sequence:06d}.{('png', 'jpg')[self.format]}"
        whole, data = cv2.imencode(path.suffix, frame.pixels)
        try:
            if not whole:
                raise OSError(0, "the picture cannot be coded")
            path.write_bytes(data.tobytes())
        except OSError as error:
            raise RunError(f"cannot write the picture '{path}': {error.strerror}") from error
