"""What commands print, and where they write it."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from quadvis.errors import Fault
from quadvis.machine.files import Kind, write_output


def print_json(data: Any) -> None:
    """Print plain data as one line of JSON."""
    print(json_text(data))


def json_text(data: Any, indent: int | None = None) -> str:
    """Return plain data as JSON; ValueError if there is a number that JSON does not know."""
    import json

    return json.dumps(data, indent=indent, allow_nan=False)


def print_warnings(diagram: Any, options: argparse.Namespace) -> None:
    """Print the warnings of a diagram, unless they go into JSON."""
    if not options.json:
        for warning in diagram.warnings:
            print(warning, file=sys.stderr)


def plain_faults(faults: Iterable[Fault]) -> list[dict[str, Any]]:
    """Return faults or warnings as plain data."""
    return [
        {"file": fault.place.file, "line": fault.place.line, "column": fault.place.column,
         "subject": fault.subject, "problem": fault.problem, "remedy": fault.remedy}
        for fault in faults
    ]  # fmt: skip


def terminal_width() -> int | None:
    """Return the width of the terminal; None if the text goes elsewhere."""
    from shutil import get_terminal_size

    return get_terminal_size().columns if sys.stdout.isatty() else None


def write_text(text: str, output: str, kind: Kind, inputs: Sequence[Path] = ()) -> int:
    """Write a text to a file, and print its name; or print the text, for "-". Return the exit code."""
    if output == "-":
        sys.stdout.write(text)
        return 0
    write_output(output, kind, text, inputs)
    print(output)
    return 0
