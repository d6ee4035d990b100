"""`files`: the SHA-256 of the files that blocks read; a resolved diagram has this section."""

from __future__ import annotations

import os
from typing import Any

from quadvis.diagram.sections.forms import Schema
from quadvis.diagram.sections.section import Checked, FileSection
from quadvis.document import YamlNode
from quadvis.errors import Faults
from quadvis.graph.graph import Graph
from quadvis.machine.inputs import file_digest
from quadvis.machine.shipped import named_file, portable_name

Files = dict[str, YamlNode]  # SHA-256 by path


class FilesSection(FileSection[Files]):
    """The files that blocks read, as they were when the diagram was written out."""

    key = "files"
    words = (
        "SHA-256 of the files that blocks read, as they were read; in resolved diagrams, as a log keeps them"
    )

    def read(self, node: YamlNode | None, faults: Faults) -> Files:
        """Return the sums as they are written."""
        mapping = faults.collect(node.mapping) if node is not None else None
        return dict(mapping.values) if mapping is not None else {}

    def schema(self) -> Schema:
        """Return the schema: texts by path."""
        return {"type": "object", "description": "SHA-256 of the files that blocks read"}

    def resolved(self, diagram: Checked) -> Any:
        """Return the sums of the files that parameters name to be read."""
        sums = {path: diagram.files[path] for path in _named(diagram.graph) if path in diagram.files}
        folder = diagram.path.parent
        return {portable_name(path, folder): digest for path, digest in sorted(sums.items())} or None


def _named(graph: Graph) -> list[str]:
    """Return the paths that parameters name to be read."""
    return [
        getattr(node.block, param.name)
        for node in graph.nodes
        for param in node.block.interface.params.values()
        if param.is_file and not param.writes
    ]


def check_files(files: Files, faults: Faults) -> None:
    """Report the files that have changed since the diagram was written out."""
    for name, node in files.items():
        wanted = faults.collect(node.text)
        path = named_file(name, node.file)
        if not os.path.isfile(path):
            faults.add(node.place, f"there is no file '{name}'", "paths are relative to the diagram")
        elif wanted is not None and file_digest(path) != wanted:
            faults.add(
                node.place,
                f"file '{name}' is not what it was: its SHA-256 differs",
                "bring that one back, or leave the entry out",
            )


FILES = FilesSection()
