"""The class of sections: one key at the top of a file, with everything that the project says about it.

A new key is one module with a subclass of `FileSection`, if the file alone says what it means, or of
`RunSection` (`context.py`), if it names blocks and signals; and one line in `quadvis.diagram.keys`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from quadvis.block import Block
from quadvis.diagram.sections.forms import Schema
from quadvis.document import YamlNode
from quadvis.errors import Faults
from quadvis.graph.graph import Graph

Value = TypeVar("Value")
Said = TypeVar("Said", covariant=True)
DIAGRAM, PART, GROUP = "diagram", "part", "group"  # the kinds of files that have sections


class Checked(Protocol):
    """A diagram without a fault, as far as its sections need it to write themselves out."""

    @property
    def graph(self) -> Graph:
        """Its blocks in execution order."""

    @property
    def values(self) -> Values:
        """The values of its sections."""

    @property
    def stop_time(self) -> Fraction:
        """Length of a run (s), also if it was replaced from outside."""

    @property
    def seed(self) -> int:
        """Seed of the noise, also if it was replaced from outside."""

    @property
    def path(self) -> Path:
        """The diagram's file."""

    @property
    def files(self) -> Mapping[str, str]:
        """SHA-256 of every file that was read, by path."""


class Section(ABC, Generic[Said]):
    """One key at the top of a file. ``words`` is its row in the table of keys in diagrams/README.md."""

    key: ClassVar[str]
    words: ClassVar[str]
    required: ClassVar[bool] = False
    kinds: ClassVar[tuple[str, ...]] = (DIAGRAM,)

    @abstractmethod
    def schema(self) -> Schema:
        """Return the JSON schema of the key's value."""

    def definitions(self, blocks: Mapping[str, type[Block]]) -> Mapping[str, Schema]:
        """Return the definitions to which the schema refers; ``blocks`` are all existing blocks."""
        return {}

    def resolved(self, diagram: Checked) -> Any:
        """Return the key's value in the resolved diagram as plain data; None leaves the key out.

        The hash of a diagram is made of this: whatever changes here changes it.
        """
        return None


class FileSection(Section[Said]):
    """A section that its file alone explains."""

    @abstractmethod
    def read(self, node: YamlNode | None, faults: Faults) -> Said:
        """Return the value of the section; ``node`` is None if the key is not written."""


class Values:
    """The values of the sections of a file, each under its section: ``values[SEED]`` is a number."""

    def __init__(self, found: Mapping[str, Any] | None = None) -> None:
        self._found = dict(found or {})

    def __getitem__(self, section: Section[Value]) -> Value:
        value: Value = self._found[section.key]
        return value

    def __setitem__(self, section: Section[Value], value: Value) -> None:
        self._found[section.key] = value

    def __or__(self, other: Values) -> Values:
        return Values(self._found | other._found)

    def replaced(self, section: Section[Value], value: Value) -> Values:
        """Return the same with another value of one section."""
        return Values(self._found | {section.key: value})
