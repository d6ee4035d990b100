"""Arguments of verbs: what a value must be, in words and as a check."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from quadvis.errors import quoted
from quadvis.wire.limits import DEPTH, MESSAGE, NAME, PIECE
from quadvis.wire.refusals import BadError

REQUIRED = object()  # in the place of a default


@dataclass(frozen=True)
class ArgumentType:
    """What a value must be: words such as "a whole number from 1 to 9", and the check."""

    words: str
    holds: Callable[[Any], bool]


@dataclass(frozen=True)
class Argument:
    """One argument of a verb: its name, type and meaning, and what it is if it is not given."""

    name: str
    type: ArgumentType
    doc: str
    default: Any = REQUIRED

    def check(self, value: Any) -> None:
        """Raise BadError if a value is not what the argument must be."""
        if not self.type.holds(value):
            raise BadError(f"'{self.name}' must be {self.type.words}, not {quoted(value)}")


def is_number(value: Any) -> bool:
    """Return whether a value is a number that is not NaN; infinite ones are numbers."""
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isnan(value)


def is_whole(value: Any, least: int, most: int) -> bool:
    """Return whether a value is a whole number between two others."""
    return isinstance(value, int) and not isinstance(value, bool) and least <= value <= most


def text(longest: int = NAME, pattern: str = "", words: str = "") -> ArgumentType:
    """Return the type of a printable text; ``pattern`` is a regular expression for all of it."""
    plain = re.compile(pattern, re.ASCII) if pattern else None

    def holds(value: Any) -> bool:
        fits = isinstance(value, str) and 0 < len(value) <= longest and value.isprintable()
        return fits and (plain is None or plain.fullmatch(value) is not None)

    return ArgumentType(words or f"a text of 1 to {longest} characters", holds)


def whole(least: int, most: int) -> ArgumentType:
    """Return the type of a whole number."""
    return ArgumentType(f"a whole number from {least} to {most}", lambda value: is_whole(value, least, most))


def number(least: float, most: float, words: str) -> ArgumentType:
    """Return the type of a number; ``most`` may be infinite, and then the number may be so, too."""
    return ArgumentType(words, lambda value: is_number(value) and least <= value <= most)


TRUTH = ArgumentType("true or false", lambda value: isinstance(value, bool))
DIGEST = text(64, "[0-9a-f]{64}", "a SHA-256 as 64 hexadecimal digits")
BYTES = ArgumentType(f"at most {PIECE} bytes", lambda value: isinstance(value, bytes) and len(value) <= PIECE)


def list_of(each: ArgumentType, most: int, least: int = 1) -> ArgumentType:
    """Return the type of a list."""
    return ArgumentType(
        f"a list of {least} to {most}, each {each.words}",
        lambda value: isinstance(value, list) and least <= len(value) <= most and all(map(each.holds, value)),
    )


def map_of(each: ArgumentType, most: int) -> ArgumentType:
    """Return the type of a map with names as its keys."""
    name = text()

    def holds(value: Any) -> bool:
        if not isinstance(value, dict) or not 0 < len(value) <= most:
            return False
        return all(map(name.holds, value)) and all(map(each.holds, value.values()))

    return ArgumentType(f"a map of 1 to {most} names, each to {each.words}", holds)


def or_none(other: ArgumentType) -> ArgumentType:
    """Return the type of a value that may be left open."""
    return ArgumentType(f"{other.words}, or nil", lambda value: value is None or other.holds(value))


def _is_setting(value: Any, depth: int = DEPTH) -> bool:
    if isinstance(value, bool):
        return True
    if isinstance(value, int):
        return -(2**63) <= value < 2**63
    if isinstance(value, float):
        return math.isfinite(value)
    if isinstance(value, str):
        return len(value) <= MESSAGE and value.isprintable()
    return isinstance(value, list) and depth > 0 and all(_is_setting(each, depth - 1) for each in value)


SETTING = ArgumentType("a finite number, a truth value, a text, or nested lists of them", _is_setting)
