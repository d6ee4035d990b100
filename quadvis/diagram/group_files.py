"""The files of groups, each read once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from pathlib import Path

from quadvis.diagram.group import GROUP_KEY, Group, Use, names_group
from quadvis.diagram.sections.params import PARAMS
from quadvis.diagram.spec import FileSpec
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import UNKNOWN, Faults, Place, Unknown, closest, known, quoted
from quadvis.machine.missing_file import RELATIVE, file_trouble
from quadvis.machine.shipped import named_file


class GroupFiles:
    """The files of groups, each read once; its faults are reported then."""

    def __init__(self, read: Callable[[Path, Faults], FileSpec | Unknown], faults: Faults) -> None:
        self._read_file, self.faults = read, faults
        self._specs: dict[str, FileSpec | Unknown] = {}
        self._uses: dict[str, Use] = {}
        self._groups: dict[tuple[str, Place], Group] = {}  # one object for each place that names a file

    @property
    def files(self) -> list[Path]:
        """The files that were read."""
        return [spec.path for spec in self._specs.values() if known(spec)]

    def resolved(self, declared: YamlNode | Unknown, value: YamlNode | Unknown) -> YamlNode | Unknown:
        """Return a parameter's value, or the group that it names.

        ``{group: file}`` names one, and so does a file alone where a group is declared.
        """
        if value is UNKNOWN or isinstance(value, Group):
            return value
        if isinstance(value, YamlMap) and names_group(value):
            return self._group(value.fields((GROUP_KEY,), (), self.faults)[GROUP_KEY])
        return self._group(value) if names_group(declared) else value

    def _group(self, named: YamlNode) -> Group | Unknown:
        text = self.faults.read(named.text)
        if not known(text):
            return UNKNOWN
        path = named_file(text, named.file)
        real = os.path.realpath(path)
        if real not in self._specs:
            problem, remedy = file_trouble(str(path), text)
            if remedy == RELATIVE and not named.line:
                remedy = "it is looked for in the working directory"
            if problem:
                self.faults.add(named.place, problem, remedy)
                return UNKNOWN
            with self.faults.about(""):
                self._specs[real] = self._read_file(path, self.faults)
        spec = self._specs[real]
        if not known(spec):
            return UNKNOWN
        key = real, named.place
        if key not in self._groups:
            use = self._uses.setdefault(real, Use())
            self._groups[key] = Group(spec[PARAMS], use, named)
        return self._groups[key]

    def warn_unused(self) -> None:
        """Warn of parameters of groups that nothing took, and whose names are near one that would be taken.

        A group serves several diagrams, so one that a diagram has no use for is no mistake. All blocks have
        been made before.
        """
        for real, use in self._uses.items():
            for name, node in self._entries(real):
                near = closest(name, use.wanted - use.taken) if name not in use.taken else None
                if near is not None:
                    problem = f"nothing takes '{name}' of this group"
                    self.faults.warn(node.place, problem, f"did you mean {quoted(near)}?")

    def _entries(self, real: str) -> Iterator[tuple[str, YamlNode]]:
        spec = self._specs[real]
        for name, node in spec[PARAMS].items() if known(spec) else ():
            if known(node):
                yield name, node
