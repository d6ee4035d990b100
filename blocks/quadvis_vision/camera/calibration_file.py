"""Reading the YAML of calibration files: a file that is something else is refused without a word of it.

A diagram may come from anybody and name any file as its calibration. Messages that quote what is wrong help
whoever edits a calibration, but must not show lines of another file to whoever reads the messages.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.document import MAX_BYTES, read_yaml
from quadvis.errors import DiagramError, Fault, Place, QuadvisError
from quadvis.machine.inputs import read_input

if TYPE_CHECKING:
    from collections.abc import Collection

    from quadvis.document import YamlMap


def read_fields(path: str | Path, kind: str, required: Collection[str], optional: Collection[str]) -> YamlMap:
    """Return the nodes of a file's keys; `DiagramError` as `quadvis.document.read_yaml` and `Node.fields`.

    `kind` is what the file should be, such as "a camera calibration". One that does not look like it is
    refused as a whole.
    """
    try:
        return read_yaml(path).fields(required, optional)
    except DiagramError as error:
        quoting = any(fault.place.line for fault in error.faults)
        if not quoting or _looks_right(path, required):
            raise
        remedy = f"that has the keys {', '.join(required)}"
        raise DiagramError([Fault(Place(str(path)), "", f"this is not {kind}", remedy)]) from None


def _looks_right(path: str | Path, keys: Collection[str]) -> bool:
    """Return whether a line begins with one of the keys, however wrong the rest may be."""
    try:
        data = read_input(path, MAX_BYTES)
    except QuadvisError:
        return False
    return re.search(rf"^[\"']?(?:{'|'.join(keys)})[\"']?\s*:".encode(), data, re.MULTILINE) is not None
