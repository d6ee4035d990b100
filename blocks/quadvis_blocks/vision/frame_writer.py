"""Writes frames into a folder, to be looked at or played again."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from quadvis.block import Block, Frame, In, Param, ParameterError, State
from quadvis.errors import QuadvisError, RunError
from quadvis.machine.files import JPG, PNG, check_output, write_output
from quadvis_vision.pictures.drawing import is_picture

KINDS = {".png": PNG, ".jpg": JPG}
NAMES = r"\d{6,}\.(png|jpg)"  # of the pictures that the block writes


class FrameWriter(Block, numeric=False):
    """Writes every new frame as a picture into a folder: ``000001.png``, ``000002.png``, ...

    The number is the frame's sequence number, so `vision.image_folder` plays the pictures in order. A picture
    of an earlier run with the same name is replaced. A file that this run reads and a file of another kind
    are never replaced. Frames that are not pictures (uint8, three channels, with pixels) are skipped.
    RunError if a picture cannot be written.
    """

    harmless = "pictures in a folder move nothing"

    frame = In("frame", doc="the frames to write")

    folder = Param(type="file", writes=True, doc="folder; it is made if it does not exist")
    format = Param("png", choices=("png", "jpg"), doc="png keeps every bit, jpg is some ten times smaller")
    every = Param(1, type="int64", min=1, doc="number of frames of which one is written")

    written = State("int64", 0)  # sequence number of the last new frame
    seen = State("int64", 0)  # number of new frames so far

    example = """
        pictures: {block: vision.image_folder, rate: slow, with: {folder: "quadvis:recordings/hand_held"}}
        writer:
          block: vision.frame_writer
          rate: slow
          with: {folder: runs/seen, format: jpg}
          in: {frame: pictures.frame}
    """

    def check(self) -> None:
        """Refuse a folder that is a file."""
        if Path(self.folder).is_file():
            raise ParameterError("folder", f"folder must be a folder, '{self.folder}' is a file")

    def open(self) -> None:
        """Make the folder; ParameterError if a file that the run might replace must not be replaced."""
        try:
            Path(self.folder).mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise RunError(f"cannot make the folder '{self.folder}': {error.strerror}") from error
        self.check_written()

    def check_written(self) -> None:
        """Refuse files in the folder that the run might replace and that must not be replaced."""
        if not Path(self.folder).is_dir():
            return
        try:
            old = [path for path in Path(self.folder).iterdir() if re.fullmatch(NAMES, path.name)]
        except OSError as error:
            problem = f"folder '{self.folder}' cannot be read: {error.strerror}"
            raise ParameterError("folder", problem) from error
        try:
            for path in old:
                check_output(path, KINDS[path.suffix])
        except QuadvisError as error:
            raise ParameterError("folder", str(error)) from error

    def write(self, frame: Frame) -> None:
        """Write a frame that is new."""
        due = self.seen % self.every == 0
        if frame.sequence in (0, self.written) or not due or not is_picture(frame.pixels):
            return
        import cv2

        path = Path(self.folder) / f"{frame.sequence:06d}{list(KINDS)[self.format]}"
        try:
            whole, data = cv2.imencode(path.suffix, np.ascontiguousarray(frame.pixels))
        except cv2.error:
            whole = False
        if not whole:
            raise RunError(f"cannot write the picture '{path}': the picture cannot be coded")
        write_output(path, KINDS[path.suffix], data.tobytes())

    def update(self, frame: Frame) -> None:
        """Count a frame that is new."""
        if frame.sequence not in (0, self.written):
            self.written = frame.sequence
            self.seen += 1
