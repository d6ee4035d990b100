"""The command line. Each command imports what it needs, so that `--help` and `check` stay quick."""

from __future__ import annotations

import os
import sys
from collections.abc import Sequence

from quadvis.cli.options import parser
from quadvis.errors import QuadvisError
from quadvis.signals import end_orderly

INTERRUPTED, PIPE_BROKEN = 130, 141


def main(arguments: Sequence[str] | None = None) -> int:
    """Run a command and return its exit code: 0 ok, 1 a run failed or missed what it should, 2 bad input."""
    options = parser().parse_args(arguments)
    end_orderly()
    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="backslashreplace")  # a name may hold what the terminal cannot show
    try:
        code = int(options.command(options))
        sys.stdout.flush()
        return code
    except QuadvisError as error:
        print(error, *getattr(error, "__notes__", ()), sep="\n", file=sys.stderr)
        return error.exit_code
    except KeyboardInterrupt as error:
        print("interrupted", *getattr(error, "__notes__", ()), sep="\n", file=sys.stderr)
        return INTERRUPTED
    except BrokenPipeError:
        # The reader of the pipe has gone; Python would complain about what is still to be written.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return PIPE_BROKEN
