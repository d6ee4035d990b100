"""What every program of tools/ has around its work: its arguments, and sentences in place of tracebacks."""

from __future__ import annotations

import argparse
import math
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from quadvis.cli.arguments import Parser, understood
from quadvis.errors import QuadvisError, quoted, sentence, suggestion
from quadvis.machine.exits import ended, listen
from quadvis.machine.interrupts import end_orderly

_Section = TypeVar("_Section")
_LONGEST = 1e9  # s
_COUNT = re.compile("[1-9][0-9]{0,8}")
_DIMENSIONS = re.compile("([1-9][0-9]{0,3})[xX]([1-9][0-9]{0,3})")


def run_tool(
    name: str,
    declare: Callable[[argparse.ArgumentParser], None],
    run: Callable[[argparse.Namespace], int | None],
    description: str | None,
    examples: str = "",
) -> int:
    """Run a tool with the arguments that it declares; return its exit code, 0 if `run` returns None.

    A `QuadvisError` of the tool, or a wrong argument, becomes a sentence after the tool's name. The help
    shows description and examples as they are written.
    """
    listen()
    end_orderly()
    formatter = argparse.RawDescriptionHelpFormatter
    parser = Parser(prog=name, description=description, epilog=examples, formatter_class=formatter)
    declare(parser)
    return ended(lambda: run(understood(parser, sys.argv[1:])) or 0, name, enough=0)


def chosen(names: Sequence[str], sections: Mapping[str, _Section]) -> dict[str, _Section]:
    """Return the sections that are named, all of them if none is; QuadvisError for an unknown name."""
    for name in names:
        if name not in sections:
            raise QuadvisError(sentence(f"there is no section {quoted(name)}", suggestion(name, sections)))
    return {name: sections[name] for name in names or sections}


def positive(text: str) -> int:
    """Read a whole number from 1 on, for an option's ``type``."""
    if _COUNT.fullmatch(text) is None:
        raise argparse.ArgumentTypeError(f"{quoted(text)} is not a whole number from 1 on")
    return int(text)


def waiting_time(text: str) -> float:
    """Read a time to wait (s), for an option's ``type``."""
    try:
        found = float(text)
    except ValueError:
        found = math.nan
    if not 0.0 <= found <= _LONGEST:
        raise argparse.ArgumentTypeError(f"{quoted(text)} is no number of seconds from 0 to {_LONGEST:g}")
    return found


def dimensions(text: str) -> tuple[int, int]:
    """Read two whole numbers from 1 on, such as 9x6, for an option's ``type``."""
    match = _DIMENSIONS.fullmatch(text.strip())
    if match is None:
        raise argparse.ArgumentTypeError(f"{quoted(text)} is not two numbers from 1 to 9999")
    return int(match[1]), int(match[2])
