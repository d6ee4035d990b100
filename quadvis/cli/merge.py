"""`quadvis merge`: what git calls to merge three versions of a diagram."""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from quadvis.diff.merge import merge_or_none
from quadvis.errors import QuadvisError
from quadvis.machine.files import YAML, write_output
from quadvis.machine.inputs import read_input

FAILED = 1


def merge(options: argparse.Namespace) -> int:
    """Merge into OURS; 1 with conflicts, which are said in words and stand between marks."""
    paths = options.base, options.ours, options.theirs
    texts = [read_input(path).decode(errors="surrogateescape") for path in paths]
    found = merge_or_none(*texts)
    if found is None:
        return _by_lines(*paths)
    write_output(Path(options.ours), YAML, found.text)
    for sentence in found.conflicts:
        print(f"conflict: {sentence}", file=sys.stderr)
    return FAILED if found.conflicts else 0


def _by_lines(base: str, ours: str, theirs: str) -> int:
    """Let git merge texts that are no YAML, line by line."""
    print(
        f"'{ours}', or what is merged into it, is no YAML that can be merged by key; lines are",
        file=sys.stderr,
    )
    try:
        done = subprocess.run(["git", "merge-file", ours, base, theirs], check=False)
    except OSError as error:
        raise QuadvisError(f"git cannot be called: {error.strerror}") from error
    return FAILED if done.returncode else 0
