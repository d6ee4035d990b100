"""`quadvis fmt`: writes YAML files in the house style, or says which ones are not in it."""

from __future__ import annotations

import argparse
import difflib
from pathlib import Path

from quadvis.document import read_yaml
from quadvis.document.style import formatted
from quadvis.document.tree import YamlMap
from quadvis.machine.files import YAML, write_output
from quadvis.machine.inputs import read_input

FAILED = 1


def fmt(options: argparse.Namespace) -> int:
    """Format files; with --check or --diff none is written, and with --check 1 is returned if one changes."""
    changed = [each for each in options.files if _one(each, options)]
    return FAILED if changed and options.check else 0


def _one(path: str, options: argparse.Namespace) -> bool:
    """Format one file; return whether it was not in the style."""
    from quadvis.diagram.key_order import ranks_of

    root = read_yaml(path)
    text = read_input(path).decode()
    found = formatted(text, path, ranks_of(list(root) if isinstance(root, YamlMap) else []))
    if found == text:
        return False
    if options.diff:
        lines = difflib.unified_diff(
            text.splitlines(), found.splitlines(), path, f"{path} in style", lineterm=""
        )
        print("\n".join(lines))
    else:
        print(path)
    if not (options.check or options.diff):
        write_output(Path(path), YAML, found)
    return True
