"""Pictures from a folder, in place of a camera."""

from __future__ import annotations

import os
import re
from hashlib import sha256
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from quadvis.block import Block, Frame, Out, Param, ParameterError, State, Work
from quadvis.errors import QuadvisError
from quadvis.machine.inputs import note_digest
from quadvis_vision.pictures.reader import SUFFIXES, read_coded

FileState = tuple[int, int]


class ImageFolder(Block, numeric=False):
    """Plays the pictures of a folder, one at each tick, in the order of the numbers in their names.

    Each picture is stamped with the time of its tick. The last picture stays on the wire with its stamp and
    sequence number, and `finished` is true; with `loop` the first picture follows the last, and the sequence
    numbers continue. A picture that cannot be read, is cut short, or declares more than 64 million pixels
    becomes a frame without pixels (0, 0, 3), with a stamp and number like any other. A picture that has
    changed since the beginning of the run becomes such a frame, too. A folder that has changed before the run
    is refused. The orientation that a file may ask for is ignored, because a calibration is for the pixels of
    the sensor.

    Source: section 6.1, the comparison of pose estimates on a recorded sequence.
    """

    frame = Out("frame", doc="the picture of this tick, or the last one")
    finished = Out("bool", doc="true when there is no picture left")

    folder = Param(type="file", doc="folder with png, jpg or bmp files")
    pattern = Param("*", type="str", doc="pattern of the file names, such as left*.jpg")
    loop = Param(
        False,
        type="bool",
        doc="begin again after the last picture; detectors then need `repeats: news`",
    )

    played = State("int64", 0)  # pictures that were on the wire
    stamp = State("float64")  # of the last picture
    at_end = Work("bool")

    example = """
        pictures: {block: vision.image_folder, rate: slow, with: {folder: "quadvis:recordings/hand_held"}}
    """

    def check(self) -> None:
        """Refuse a folder that is missing or has no picture."""
        if not self.read_file("folder", self._listed):
            kinds = ", ".join(suffix[1:] for suffix in SUFFIXES)
            problem = f"no picture in '{self.folder}' matches '{self.pattern}'"
            raise ParameterError("pattern", f"{problem}; it needs at least one file of {kinds}")

    def reads(self) -> list[str]:
        """Return the pictures."""
        return [str(path) for path in self.pictures()]

    def pictures(self) -> list[Path]:
        """Return the files in the order in which they are played."""
        return list(self.read_file("folder", self._listed))

    def _listed(self, folder: str) -> dict[Path, FileState]:
        """Return the files in the order in which they are played, each with the state that shows a change."""
        if not Path(folder).is_dir():
            problem = f"folder '{folder}' does not exist; name a folder with pictures"
            raise ParameterError("folder", problem)
        found = {path: state for path in self._find() if (state := state_of(path)) is not None}
        note_digest(os.path.join(folder, ""), sha256(repr(sorted(found.items())).encode()).hexdigest())
        return found

    def _find(self) -> list[Path]:
        try:
            found = list(Path(self.folder).glob(self.pattern))
        except (ValueError, NotImplementedError):
            problem = f"pattern '{self.pattern}' does not name files in the folder; write e.g. '*.png'"
            raise ParameterError("pattern", problem) from None
        return sorted((p for p in found if p.suffix.lower() in SUFFIXES and p.is_file()), key=natural_order)

    def open(self) -> None:
        """Refuse a folder that has changed since the diagram was checked."""
        self._states = self.read_file("folder", self._listed)
        now = {path: state_of(path) for path in self._find()}
        for path in [*self._states, *now]:
            if self._states.get(path) != now.get(path):
                change = "new" if path not in self._states else "changed" if path in now else "gone"
                problem = f"folder '{self.folder}' is not what it was when the diagram was loaded"
                raise ParameterError("folder", f"{problem}: '{path.name}' is {change}; load it again")
        self._paths = list(self._states)
        self._last = Frame.none()

    def read(self, time: float) -> None:
        """Read the picture of this tick."""
        self.at_end = not self.loop and self.played >= len(self._paths)
        sequence, stamp = (self.played, self.stamp) if self.at_end else (self.played + 1, time)
        if (self._last.sequence, self._last.stamp) != (sequence, stamp):
            pixels = self._read(self._paths[(sequence - 1) % len(self._paths)])
            self._last = Frame(pixels, stamp, sequence)

    def output(self) -> tuple[Frame, bool]:
        """Return the picture of this tick and whether the folder is at its end."""
        return self._last, self.at_end

    def _read(self, path: Path) -> NDArray[np.uint8]:
        """Return a picture, without pixels if the file cannot be used or has changed."""
        return read_frame(path) if state_of(path) == self._states[path] else Frame.none().pixels

    def update(self, time: float) -> None:
        """Count the picture that was on the wire."""
        if not self.at_end:
            self.played += 1
            self.stamp = time


def state_of(path: Path) -> FileState | None:
    """Return the state that shows a change of a file: length in bytes and time of the last change (ns)."""
    try:
        found = path.stat()
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns


def natural_order(path: Path) -> tuple[list[tuple[int, int | str]], str]:
    """Return a key that sorts view2 before view10; it also orders names that differ only in case or zeros."""
    parts = re.split(r"([0-9]+)", path.name.casefold())
    return [(0, int(part)) if part.isdigit() else (1, part) for part in parts if part], path.name


def read_frame(path: Path) -> NDArray[np.uint8]:
    """Return the picture (height, width, 3) BGR; without pixels (0, 0, 3) if the file cannot be used."""
    try:
        return read_coded(path).decode()
    except QuadvisError:
        return Frame.none().pixels
