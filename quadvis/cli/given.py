"""What options give: a diagram, and what becomes of the blocks beside it."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from quadvis.diagram.diagram import Diagram
    from quadvis.library.catalogue import OwnBlocks

YAML = (".yaml", ".yml")
FAILED = 1  # the exit code of a run that failed, or missed what is expected


def load_diagram(options: argparse.Namespace, **more: Any) -> Diagram:
    """Return the diagram, with its variant, settings and parameter files."""
    from quadvis.diagram.load import load

    given = {"variant": options.variant, "settings": options.set, "params": options.params}
    return load(options.file, **given, **more, own_blocks=own_blocks(options))


def own_blocks(options: argparse.Namespace) -> OwnBlocks:
    """Return the treatment of the blocks beside a diagram: refuse them, or announce them once."""
    if options.no_own_blocks:
        return False
    said = set()

    def say(folder: Path) -> None:
        if folder not in said:
            what = "own blocks" if folder.is_dir() else "machine code"
            print(f"{what} from {str(folder)!r}", file=sys.stderr, flush=True)
        said.add(folder)

    return say
