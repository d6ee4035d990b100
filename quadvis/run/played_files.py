"""Files that blocks read while they run, such as the pictures of a folder: a replay needs the same ones."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping

from quadvis.diagram.diagram import Diagram
from quadvis.errors import QuadvisError, counted, quoted
from quadvis.machine.inputs import file_digest
from quadvis.machine.shipped import named_file, portable_name

SHOWN = 3  # files in a message


def played_files(diagram: Diagram) -> dict[str, str]:
    """Return the SHA-256 of the files that a run reads and that the resolved diagram does not list.

    The names are those that a diagram of the same folder would give.
    """
    paths = {path for node in diagram.graph.nodes for path in node.block.reads()} - diagram.files.keys()
    files = [path for path in sorted(paths) if os.path.isfile(path)]
    return {portable_name(path, diagram.path.parent): file_digest(path) for path in files}


def check_played_files(diagram: Diagram, wanted: Mapping[str, str]) -> None:
    """Refuse a diagram whose files are not those of the recorded run; QuadvisError names them."""
    now = played_files(diagram)
    problems = [
        f"file {quoted(name)} is not what it was: its SHA-256 differs"
        if name in now
        else f"file {quoted(name)} is no longer read"
        if named_file(name, str(diagram.path)).exists()
        else f"there is no file {quoted(name)}"
        for name in wanted
        if now.get(name) != wanted[name]
    ]
    problems += [f"file {quoted(name)} is new" for name in now if name not in wanted]
    if problems:
        more = len(problems) - SHOWN
        rest = f"; and {counted(more, 'more file')}" if more > 0 else ""
        raise QuadvisError(f"the run cannot be repeated: {'; '.join(problems[:SHOWN])}{rest}")


def files_text(files: Mapping[str, str]) -> str:
    """Return the files as a log keeps them; "" if there are none."""
    return json.dumps(files, indent=0) if files else ""
