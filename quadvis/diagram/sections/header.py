"""`quadvis`, `name` and `doc`: the format, the name and the purpose of a file."""

from __future__ import annotations

from quadvis.diagram.sections.forms import TEXT, Schema
from quadvis.diagram.sections.section import DIAGRAM, GROUP, PART, Checked, FileSection
from quadvis.document import YamlMap, YamlNode
from quadvis.errors import Faults

VERSION = 1


def is_version(root: YamlMap, faults: Faults) -> bool:
    """Report a file of another version in one sentence, not by all that is odd in it."""
    version = root.get("quadvis")
    if version is not None and faults.collect(version.integer) not in (VERSION, None):
        remedy = f"this quadvis reads version {VERSION}"
        faults.add(version.place, f"the file is of version {version.to_python()}", remedy)
        return False
    return True


class Format(FileSection[int]):
    """The version of the format; `is_version` has looked at it before the other sections are read."""

    key = "quadvis"
    words = "version of the format, 1; must be there"
    required = True
    kinds = (DIAGRAM, PART, GROUP)

    def read(self, node: YamlNode | None, faults: Faults) -> int:
        """Return the version that this quadvis reads."""
        return VERSION

    def schema(self) -> Schema:
        """Return the schema: one number."""
        return {"const": VERSION, "description": "version of the format"}

    def resolved(self, diagram: Checked) -> int:
        """Return the version."""
        return VERSION


class Name(FileSection[str]):
    """The name of a diagram or part; empty where it cannot be read."""

    key = "name"
    words = "the diagram's name, and its log's"
    required = True
    kinds = (DIAGRAM, PART, GROUP)

    def read(self, node: YamlNode | None, faults: Faults) -> str:
        """Return the name."""
        return (faults.collect(node.text) if node is not None else None) or ""

    def schema(self) -> Schema:
        """Return the schema: a text."""
        return {**TEXT, "description": "name of the diagram, and of its log"}

    def resolved(self, diagram: Checked) -> str:
        """Return the name."""
        return diagram.graph.name


class Doc(FileSection[str]):
    """The purpose of a file, in words for people."""

    key = "doc"
    words = "what it is for"
    kinds = (DIAGRAM, PART, GROUP)

    def read(self, node: YamlNode | None, faults: Faults) -> str:
        """Return the text."""
        return (faults.collect(node.text) if node is not None else None) or ""

    def schema(self) -> Schema:
        """Return the schema: a text."""
        return {**TEXT, "description": "what it is for"}


FORMAT, NAME, DOC = Format(), Name(), Doc()
