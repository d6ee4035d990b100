"""`quadvis completion SHELL`: what a shell needs to complete commands, options, files and names of blocks.

shtab makes the script from the declared options, once and for all, so that no key waits for Python.
"""

from __future__ import annotations

from collections.abc import Iterable

import shtab

from quadvis.cli.arguments import Parser
from quadvis.library.catalogue import Catalogue
from quadvis.library.shipped_files import shipped_names

FILES = (
    "FILE",
    "LOG",
    "PATH",
    "PNG",
    "TABLE",
    "FILE.yaml",
    "PATH.json",
    "OLD",
    "NEW",
    "A",
    "B",
    "BASE",
    "OURS",
    "THEIRS",
)
FOLDERS = ("FOLDER",)


def completion(parser: Parser, shell: str) -> str:
    """Return the script of a shell: bash, zsh, tcsh or fish. It adds to the parser what shells need."""
    for command in parser.commands.values():
        for action in (*command.places, *command.options.values()):
            if action.metavar in FILES:
                action.complete = shtab.FILE  # type: ignore[attr-defined]
            elif action.metavar in FOLDERS:
                action.complete = shtab.DIRECTORY  # type: ignore[attr-defined]
    parser.commands["describe"].places[0].choices = list(_names())
    script: str = shtab.complete(parser, shell=shell)
    return script


def _names() -> Iterable[str]:
    """Yield the names of the blocks of the standard library, and of the files that come with quadvis."""
    yield from Catalogue().names()
    yield from shipped_names()
