"""The keys of a map: those that are refused, repeated ones, and names written in one with their values."""

from __future__ import annotations

import re

from quadvis.document.node import YamlNode
from quadvis.document.tree import YamlMap, YamlScalar
from quadvis.errors import Faults, Place, quoted
from quadvis.errors.characters import first_odd, replacement, with_article

MAX_KEY = 200

_NO_BLANK = re.compile(r"([A-Za-z_]\w*)([:\u2236\ua789\ufe55\uff1a])([^\s/\\].*| .*)", re.ASCII)
_FRACTION = re.compile(r"[0-9]+(?:[eE][+-]?[0-9]+)?(?: *[A-Za-z%/°µ].*)?")
_WHOLE = re.compile(r"[+-]?[0-9]+")
_MOST_LINES = 5  # lines that are named for a repeated key


def wrong_key(node: YamlNode) -> tuple[str, str]:
    """Return the problem and the remedy for a key; ("", "") if it is right."""
    if not isinstance(node, YamlScalar):
        return "a key must be a text", "put a text that begins with '{' or '[' in quotes"
    if not node.value:
        return "a key is missing before ':'", "write 'key: value'"
    if len(node.value) > MAX_KEY:
        return f"the key {quoted(node.value)} is longer than {MAX_KEY} characters", "shorten it"
    if node.value == "<<" and node.plain:
        return "the merge key '<<' is not allowed", "write the values out"
    return "", ""


def mend_fraction(parent: YamlMap, key: YamlScalar, faults: Faults) -> bool:
    """Refuse and mend ``0,5 m``, whose second half YAML reads as a key; False if the key is none."""
    before = next(reversed(parent.values.values()), None)
    if (
        not isinstance(before, YamlScalar)
        or not before.plain
        or (before.line, before.column + len(before.value) + 1) != (key.line, key.column)
        or not _WHOLE.fullmatch(before.value)
        or not _FRACTION.fullmatch(key.value)
    ):
        return False
    wrong, right = f"{before.value},{key.value}", f"{before.value}.{key.value}"
    faults.add(before.place, f"{quoted(wrong)} has a decimal comma", f"write {quoted(right)}")
    before.value = right
    return True


def split_pair(key: YamlScalar, node: YamlScalar, faults: Faults) -> tuple[YamlScalar, YamlScalar]:
    """Refuse ``c:10 Hz`` and return its two halves."""
    match = _NO_BLANK.fullmatch(key.value)
    if match is None:
        return key, node
    name, colon, rest = match.groups()
    value = rest.lstrip()
    column = key.column + len(name)
    if colon != ":":
        problem, remedy = f"this is {with_article(colon)}", replacement(colon)
        faults.add(Place(key.file, key.line, column), problem, remedy)
    elif value == rest:
        problem = f"a blank is missing behind {quoted(name + ':')}"
        faults.add(Place(*_where(key)), problem, f"write {quoted(f'{name}: {value}')}")
    else:  # a blank character that YAML reads as a letter
        problem = f"this is {with_article(rest[0])}"
        faults.add(Place(key.file, key.line, column + 1), problem, replacement(rest[0]))
    odd = key.odd if first_odd(value) else None
    column += 1 + len(rest) - len(value)
    return YamlScalar(name, True, key.file, key.line, key.column), YamlScalar(
        value, True, key.file, key.line, column, odd=odd
    )


def refuse_repeated(parent: YamlMap, repeated: list[tuple[YamlScalar, YamlNode]], faults: Faults) -> None:
    """Refuse repeated keys, each once; the other values under them are read, too."""
    again: dict[str, list[YamlScalar]] = {}
    for key, node in repeated:
        again.setdefault(key.value, []).append(key)
        _merge(parent.values[key.value], node)
    for name, keys in again.items():
        lines = [str(key.line) for key in keys[1 : 1 + _MOST_LINES]]
        if len(keys) > 1 + _MOST_LINES:
            lines.append("...")
        more = f", and again in line {', '.join(lines)}" if lines else ""
        problem = f"key {quoted(name)} is already in line {parent.keys[name].line}{more}"
        faults.add(Place(*_where(keys[0])), problem, "keep one of them")


def _merge(first: YamlNode, second: YamlNode) -> None:
    """Add the values under a repeated key, unless they describe another thing of the same name."""
    if not isinstance(first, YamlMap) or not isinstance(second, YamlMap) or not _agree(first, second):
        return
    for key, node in second.pairs():
        if key.value in first:
            _merge(first[key.value], node)
        else:
            first.keys[key.value], first.values[key.value] = key, node


def _agree(first: YamlMap, second: YamlMap) -> bool:
    """Return whether the texts under common keys are equal."""
    pairs = [(first[key], second[key]) for key in second if key in first]
    return all(
        one.value == other.value
        if isinstance(one, YamlScalar) and isinstance(other, YamlScalar)
        else isinstance(one, YamlMap) and isinstance(other, YamlMap)
        for one, other in pairs
    )


def _where(node: YamlNode) -> tuple[str, int, int]:
    return node.file, node.line, node.column
