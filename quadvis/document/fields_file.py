"""Read the YAML files that parameters of blocks name; refuse a file of another kind without quoting it.

A diagram may come from anybody and may name any file as a calibration, for example. A message that quotes the
wrong line helps a person who edits a calibration. Of any other file a message must not show a line.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from quadvis.document.reader import MAX_BYTES, read_yaml
from quadvis.errors import DiagramError, Fault, Place, QuadvisError
from quadvis.machine.inputs import read_input

if TYPE_CHECKING:
    from collections.abc import Collection

    from quadvis.document.tree import YamlMap


def read_fields(path: str | Path, kind: str, required: Collection[str], optional: Collection[str]) -> YamlMap:
    """Return the values of a file by key; `DiagramError` as for `read_yaml` and `YamlNode.fields`.

    `kind` says what the file should be, such as "a camera calibration". A file that does not look like this
    kind is refused as a whole.
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
