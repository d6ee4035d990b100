"""The files of a file scope: logs that `quadvis plot` and `read_log` read, package after package."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from quadvis.errors import QuadvisError
from quadvis.output.log import AROUND, LogWriter
from quadvis.output.recording import RecordedBlock, RecordedPort
from quadvis.output.stretch import stamps_of
from quadvis.scopes.file_names import FileNames
from quadvis.scopes.package import Package
from quadvis.scopes.properties import COMMIT
from quadvis.scopes.scope import SignalScope


class ScopeFile:
    """Where a file scope writes its packages, from its start to its end.

    ``lost`` counts the samples that are missing: those that the run has left out, and those for which the
    disk was too slow. A file never grows above ``MaxFileSize``, but for its index: the next package begins
    the next file, if the name has a number; otherwise the file is ``full``. A signal has one message a
    sample, under the name by which the scope has it.
    """

    def __init__(self, scope: SignalScope, folder: Path, facts: Mapping[str, str]) -> None:
        """Open the first file, in place of an older one; QuadvisError if it cannot be written.

        ``facts`` are those of the run for the log (`LogWriter`).
        """
        self._scope, self._folder = scope, folder
        self._facts = {**facts, "scope": str(scope.number)}
        self._names = FileNames(scope.settings.Filename, scope.number)
        ports: dict[str, list[RecordedPort]] = {}
        for path, port in scope.plan.ports:
            ports.setdefault(path, []).append(port)
        self._blocks = [RecordedBlock(path, tuple(found), scope.plan.rate) for path, found in ports.items()]
        self._columns = self._columns_of(scope)
        self._row = sum(block.size + AROUND for block in self._blocks)  # bytes of a sample
        self.paths: list[Path] = []
        self.full = False
        self._failure = ""
        self._lost = 0
        self._writer = self._open()
        if self._writer.size + self._row > scope.settings.MaxFileSize:
            self.close()
            limit = scope.settings.MaxFileSize
            raise QuadvisError(f"the MaxFileSize of {limit} bytes leaves no room for samples; make it larger")

    @property
    def lost(self) -> int:
        """The number of samples that the files lack."""
        return self._lost + -(-self._writer.lost // len(self._blocks))

    @property
    def loss(self) -> str:
        """A sentence on why no more is written; "" as long as there is no fault."""
        return self._failure or self._writer.loss

    def write(self, package: Package) -> None:
        """Write the samples of a package, as far as there is room."""
        self._lost += package.lost
        settings = self._scope.settings
        start = 0
        while start < len(package) and not self.full:
            room = (settings.MaxFileSize - self._writer.size) // self._row
            if room <= 0:
                self._next()
                continue
            self._write(package, slice(start, start + room))
            start += room
        if self._failure:
            self._lost += len(package) - start
        if settings.WriteMode == COMMIT:
            self._writer.flush()

    def close(self) -> None:
        """End the file; a second call does nothing."""
        self._writer.close({"left out": str(self._lost)})

    def _write(self, package: Package, part: slice) -> None:
        stamps = stamps_of(package.ticks[part], self._scope.tick)
        for index, columns in enumerate(self._columns):
            rows = np.ascontiguousarray(package.samples[part, columns]).view(np.int64)
            self._writer.write_rows(index, stamps, rows)

    def _next(self) -> None:
        """Begin the next file; without one the scope is at its end."""
        if not self._names.many:
            self.full = True
            return
        self.close()
        lost = self.lost
        try:
            self._writer, self._lost = self._open(), lost
        except QuadvisError as error:
            self.full, self._failure = True, str(error)

    def _open(self) -> LogWriter:
        path = self._folder / self._names.name(len(self.paths))
        synced = self._scope.settings.WriteMode == COMMIT
        writer = LogWriter(path, self._blocks, self._facts, synced)
        self.paths.append(path)
        return writer

    def _columns_of(self, scope: SignalScope) -> list[list[int]]:
        """Return the columns of a sample that belong to each block."""
        found: dict[str, list[int]] = {block.path: [] for block in self._blocks}
        column = 0
        for path, port in scope.plan.ports:
            found[path] += range(column, column + port.size)
            column += port.size
        return list(found.values())
