"""The files of parts, each read once, however often it is used."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from quadvis.diagram.spec import FileSpec
from quadvis.errors import UNKNOWN, Faults, Unknown, known


class Parts:
    """The files of parts, each read once; its faults are reported then."""

    def __init__(self, read: Callable[[Path, Faults], FileSpec | Unknown], faults: Faults) -> None:
        self._read, self.faults = read, faults
        self._specs: dict[str, FileSpec | Unknown] = {}

    @property
    def files(self) -> list[Path]:
        """The files that were read."""
        return list(map(Path, self._specs))

    @property
    def is_whole(self) -> bool:
        """Whether all of them are known."""
        return UNKNOWN not in self._specs.values()

    def specs(self) -> list[FileSpec]:
        """Return the files that have been read."""
        return [spec for spec in self._specs.values() if known(spec)]

    def read(self, file: Path) -> FileSpec | Unknown:
        """Return the contents of a file."""
        real = os.path.realpath(file)
        if real not in self._specs:
            with self.faults.about(""):
                self._specs[real] = self._read(file, self.faults)
        return self._specs[real]
