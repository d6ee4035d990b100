"""The command line. Each command imports what it needs, so that `--help` and `check` stay quick."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from quadvis.cli.arguments import understood
from quadvis.cli.options import parser
from quadvis.machine.exits import ended
from quadvis.machine.interrupts import end_orderly


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0 ok, 1 a run failed or missed an expectation, 2 bad input."""
    end_orderly()
    return ended(lambda: _perform(arguments))


def _perform(arguments: Sequence[str] | None) -> int:
    options = understood(parser(), sys.argv[1:] if arguments is None else arguments)
    return int(options.command(options))
