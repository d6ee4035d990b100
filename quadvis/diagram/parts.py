"""The files of parts, each read once, however often it is used."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

from quadvis.diagram.sections.blocks import BlockSpec
from quadvis.diagram.spec import FileSpec
from quadvis.errors import UNKNOWN, Faults, Unknown, known
from quadvis.machine.missing_file import file_trouble
from quadvis.machine.shipped import named_file


class Parts:
    """The files of parts, each read once; its faults are reported then."""

    def __init__(self, read: Callable[[Path, Faults], FileSpec | Unknown], faults: Faults) -> None:
        self._read, self.faults = read, faults
        self._specs: dict[str, FileSpec | Unknown] = {}
        self._located: dict[tuple[str, str], tuple[Path, str]] = {}
        self._readable: set[Path] = set()

    def locate(self, block: BlockSpec) -> tuple[Path, str]:
        """Return the file of a part, and its real path."""
        key = block.kind_place.file, block.kind
        if key not in self._located:
            file = named_file(block.kind, block.kind_place.file)
            self._located[key] = file, os.path.realpath(file)
        return self._located[key]

    def trouble(self, block: BlockSpec, files: tuple[str, ...]) -> tuple[str, str]:
        """Return the problem and the remedy of a file that cannot be read; ``files`` are those around it."""
        file, _ = self.locate(block)
        if file in self._readable:
            return "", ""
        problem, remedy = file_trouble(str(file), block.kind, files)
        if not problem:
            self._readable.add(file)
        return problem, remedy

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

    def read(self, block: BlockSpec) -> FileSpec | Unknown:
        """Return the contents of the file of a part."""
        file, real = self.locate(block)
        if real not in self._specs:
            with self.faults.about(""):
                self._specs[real] = self._read(file, self.faults)
        return self._specs[real]
