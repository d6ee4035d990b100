"""LLVM's text of a module, taken apart: functions with their blocks and instructions, and constants.

Only what is needed to write the same in C: attributes and metadata are left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

_NAME = r'"(?:[^"\\]|\\.)*"|[\w.$-]+'
_DEFINED = re.compile(rf"^define .*?\b(void|i\d+|double|float|ptr) @({_NAME})\((.*)\)[^()]*\{{$")
_LABEL = re.compile(rf"^({_NAME}):")
_CONSTANT = re.compile(rf"^@({_NAME}) = .*?\b(constant|global) (.*?)(?:, align \d+)?(?:, comdat.*)?$")
_METADATA = re.compile(r"(?:, ![\w.]+ ![\w.]+(?:\([^)]*\))?)+$|, !\w+ !\{.*$")
_GROUP = re.compile(r"( #\d+)+$")
_COMMENT = re.compile(r"\s+;[^\"]*$")


@dataclass
class TextBlock:
    """A basic block: its label, and its instructions as text."""

    label: str
    lines: list[str] = field(default_factory=list)


@dataclass
class TextFunction:
    """A function: the type that it returns, its name, types and names of its parameters, its blocks."""

    returns: str
    name: str
    parameters: list[tuple[str, str]]
    blocks: list[TextBlock]


def plain(name: str) -> str:
    """Return a name without quotes and sigil."""
    return name.lstrip("%@").strip('"')


def functions(text: str) -> Iterator[TextFunction]:
    """Yield the functions that a module defines."""
    lines = iter(text.splitlines())
    for line in lines:
        match = _DEFINED.match(line.rstrip())
        if match is None:
            continue
        parameters = [_parameter(each) for each in split(match[3])]
        yield TextFunction(match[1], plain(match[2]), parameters, list(_blocks(lines)))


def _blocks(lines: Iterator[str]) -> Iterator[TextBlock]:
    block = TextBlock("")  # the first may have no label
    for line in lines:
        if line.startswith("}"):
            break
        if match := _LABEL.match(line):
            if block.lines:
                yield block
            block = TextBlock(plain(match[1]))
            continue
        instruction = line.strip()
        if instruction.startswith("switch") and instruction.endswith("["):
            rest = []
            for more in lines:
                rest.append(more.strip())
                if more.strip().startswith("]"):
                    break
            instruction = " ".join([instruction, *rest])
        if instruction and not instruction.startswith(";"):
            block.lines.append(cleaned(instruction))
    yield block


def cleaned(instruction: str) -> str:
    """Return an instruction without metadata and attribute groups."""
    return _GROUP.sub("", _METADATA.sub("", _COMMENT.sub("", instruction)))


def _parameter(text: str) -> tuple[str, str]:
    words = text.split()
    return words[0], plain(words[-1])


def constants(text: str) -> dict[str, str]:
    """Return the initial values of the constants of a module by name, each with its type before it."""
    found = {}
    for line in text.splitlines():
        if match := _CONSTANT.match(_METADATA.sub("", line.rstrip())):
            found[plain(match[1])] = match[3]
    return found


def split(text: str) -> list[str]:
    """Return the parts between commas that stand in no brackets and no quotes."""
    found, depth, start, quoted = [], 0, 0, False
    for place, letter in enumerate(text):
        if letter == '"':
            quoted = not quoted
        elif quoted:
            continue
        elif letter in "([{<":
            depth += 1
        elif letter in ")]}>":
            depth -= 1
        elif letter == "," and not depth:
            found.append(text[start:place].strip())
            start = place + 1
    rest = text[start:].strip()
    return [*found, rest] if rest else found
