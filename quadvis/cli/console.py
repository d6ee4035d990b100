"""The console: commands line by line, as at the keyboard of xPC Target."""

from __future__ import annotations

import argparse
import shlex
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from quadvis.errors import QuadvisError

if TYPE_CHECKING:
    from quadvis.host.target import Target

COMMANDS = (
    "load", "start", "stop", "unload", "status", "get", "set", "scope", "log", "sets", "profile",
)  # fmt: skip
ENDS = ("exit", "quit", "bye")


def run_console(target: Target) -> int:
    """Do the commands that are typed, on one target, until the end of the input."""
    with suppress(ImportError):
        import readline  # noqa: F401 - gives `input` a history
    prompt = f"{target.name}> " if sys.stdin.isatty() else ""
    code = 0
    while True:
        try:
            line = input(prompt).strip()
        except EOFError:
            return code
        except KeyboardInterrupt:
            print()
            continue
        if line in ENDS:
            return code
        if not line or line.startswith("#"):
            continue
        code = 0
        try:
            options = _read(line, target.name)
            options.connected = _Kept(target)
            code = int(options.command(options))
        except KeyboardInterrupt:
            print()
        except (QuadvisError, ValueError) as error:
            print(error, file=sys.stderr)
            code = getattr(error, "exit_code", 2)
        except SystemExit:  # the help of a command
            pass


def _read(line: str, name: str) -> argparse.Namespace:
    """Return a line's command with its options; QuadvisError if it is none, or means another target."""
    from quadvis.cli.arguments import understood
    from quadvis.cli.options import parser

    try:
        words = shlex.split(line)
    except ValueError:
        raise QuadvisError("a quotation mark or a backslash has no other half; write it in pairs") from None
    if words[0] not in COMMANDS:
        raise QuadvisError(f"write one of {', '.join(COMMANDS)}, or exit")
    options = understood(parser(), words)
    if options.target not in (None, name):
        raise QuadvisError(f"this console is that of {name}; leave --target out, or open another console")
    return options


class _Kept:
    """A target that stays connected when a command is done with it."""

    def __init__(self, target: Target) -> None:
        self._target = target

    def __enter__(self) -> Target:
        return self._target

    def __exit__(self, *_: object) -> None:
        """Keep it."""
