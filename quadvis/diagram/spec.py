"""The contents of one file, section by section; no other file is read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from quadvis.diagram.sections.header import NAME
from quadvis.diagram.sections.section import Section, Value, Values
from quadvis.document import YamlNode
from quadvis.errors import Place


@dataclass(frozen=True)
class FileSpec:
    """A diagram or a part as written in its file: ``spec[RATES]`` is the value of ``rates``.

    With a ``base``, values and nodes are those of the base, changed by the file; see `bases`.
    """

    path: Path
    place: Place  # of the file as a whole
    top: Place  # where its keys begin
    values: Values  # of the sections that the file alone explains
    nodes: Mapping[str, YamlNode]  # of the others, which name blocks and signals
    written: frozenset[str] = frozenset()  # the keys of the sections that are there
    base: FileSpec | None = None  # the diagram on which it stands

    def __getitem__(self, section: Section[Value]) -> Value:
        return self.values[section]

    @property
    def paths(self) -> tuple[Path, ...]:
        """Its file, and those of the diagrams on which it stands."""
        below = self.base.paths if self.base is not None else ()
        return tuple(dict.fromkeys((self.path, *below)))

    @property
    def name(self) -> str:
        """The name that it has, or that of its file."""
        return self[NAME] or self.path.stem
