"""Read YAML files that may be wrong or hostile: faults have places, costs are bounded, types are not guessed.

Nodes are composed from the event stream of PyYAML's C parser, without recursion. PyYAML's own loaders are not
used: they fail on deep nesting, expand aliases without bound, and lose duplicate keys and places.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from typing import Any

import yaml

from quadvis.document.composer import (
    FORBIDDEN,
    LINE_END,
    MAX_DEPTH,
    Composer,
    MisreadError,
    Position,
    RunOnError,
    forbidden,
)
from quadvis.document.damage import STAND_INS, Trouble, explain, run_on
from quadvis.document.node import YamlNode
from quadvis.document.number_lists import find_lists, hide_lists
from quadvis.document.tree import plain_value
from quadvis.errors import DiagramError, Fault, Faults, Place, QuadvisError
from quadvis.machine.inputs import InputError, TooLongError, read_input
from quadvis.machine.missing_file import file_trouble

MAX_BYTES = 16_000_000

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)

# Directives: libyaml compares each with all earlier ones.
_DIRECTIVE = re.compile("(?:^|[\r\n])%")

# Repairs of a refused text; each one costs a further reading.
_MOST_REPAIRS, _MOST_READ = 50, 3_000_000


def read_yaml(path: str | os.PathLike[str], faults: Faults | None = None) -> YamlNode:
    """Read a YAML file of at most 16 MB; see `parse_yaml`. Any fault raises `DiagramError`."""
    name = os.fspath(path)
    problem, remedy = file_trouble(name)
    if problem:
        raise _fault(Place(name), problem, remedy)
    try:
        data = read_input(name, MAX_BYTES)
    except TooLongError:
        problem, remedy = f"the file is larger than {MAX_BYTES // 1_000_000} MB", "split it"
        raise _fault(Place(name, 1, 1), problem, remedy) from None
    except InputError as error:
        raise _fault(Place(name), f"the file cannot be read: {error.why}") from None
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        place = _place(data[: error.start].decode("utf-8"), name)
        raise _fault(place, "the file is not UTF-8 text", "save it with the encoding UTF-8") from None
    return parse_yaml(text, name, faults)


def parse_yaml(text: str, name: str = "<text>", faults: Faults | None = None) -> YamlNode:
    """Return the root node of one YAML document.

    Aliases, anchors, merge keys, tags, duplicate keys, keys that are no texts, and everything beyond the
    limits above are refused. With `faults`, a fault that leaves the rest readable is added there and the rest
    is returned; a text that is no YAML always raises `DiagramError`.
    """
    text = text.removeprefix("\ufeff")
    if len(text) > MAX_BYTES:
        raise _fault(Place(name, 1, 1), f"the text is larger than {MAX_BYTES // 1_000_000} MB", "split it")
    bad = FORBIDDEN.search(text)
    if bad is not None:
        raise _fault(_place(text[: bad.start()], name), *forbidden(bad))
    directive = _DIRECTIVE.search(text)
    if directive is not None:
        place = _place(text[: directive.end() - 1], name)
        raise _fault(place, "a line that begins with '%' is not allowed", "leave it out")
    found = Faults() if faults is None else faults
    kept, root = _read_on(text, name)
    for fault in kept:
        found.append(fault)
    if faults is None:
        found.check()
    return root


def _read_on(text: str, name: str) -> tuple[Faults, YamlNode]:
    """Return the faults and the root; a fault that stops the parser is repaired if possible."""
    kept: list[Fault] = []
    blanks: list[tuple[int, int]] = []
    may_repair = not any(stand_in in text for stand_in in STAND_INS.values())
    read = 0
    while True:
        faults = Faults()
        for fault in kept:
            faults.append(fault)
        position = Position(name, list(blanks))
        try:
            return faults, _compose(text, position, faults)
        except yaml.YAMLError as error:
            trouble = _explained(error, text)
        except RunOnError as error:
            trouble = run_on(text, _offset(text, error.line, error.column))
        line, column = _line_column(text, trouble.at)
        fault = Fault(Place(*position.of(line, column)), "", trouble.problem, trouble.remedy)
        read += len(text)
        done = not may_repair or len(kept) >= _MOST_REPAIRS or read > _MOST_READ or fault in kept
        if trouble.repaired is None or done:
            raise DiagramError([*faults, fault])
        kept.append(fault)
        text = trouble.repaired
        if trouble.blank is not None:
            blanks.append(_line_column(text, trouble.blank))


def _explained(error: yaml.YAMLError, text: str) -> Trouble:
    """Return the fault at the place of the parser's error, without the parser's words."""
    marks = (getattr(error, "context_mark", None), getattr(error, "problem_mark", None))
    opened, at = (None if mark is None else _offset(text, mark.line, mark.column) for mark in marks)
    return explain(text, (opened or 0) if at is None else at, opened, MAX_DEPTH)


def _offset(text: str, line: int, column: int) -> int:
    starts = [0, *(match.end() for match in LINE_END.finditer(text))]
    return min(starts[line] + column, len(text)) if line < len(starts) else len(text)


def _compose(text: str, position: Position, faults: Faults) -> YamlNode:
    """Return the root; long lists of numbers are hidden from the parser, unless this makes it fail."""
    repaired = bool(faults)
    lists = find_lists(text)
    if lists:
        apart = Faults()
        apart += faults
        try:
            composer = Composer(position, apart, text, lists, repaired=repaired)
            root = composer.compose(_events(hide_lists(text, lists)))
        except (yaml.YAMLError, MisreadError):
            pass
        else:
            faults[:] = apart
            return root
    return Composer(position, faults, text, repaired=repaired).compose(_events(text))


def _events(text: str) -> Iterator[Any]:
    """Return the parser's events; the call behind the last event returns None."""
    return iter(_Loader(text).get_event, None)


def _line_column(text: str, at: int) -> tuple[int, int]:
    """Return line and column of an offset, from 0."""
    last = None
    line = 0
    for match in LINE_END.finditer(text):
        if match.end() > at:
            break
        line, last = line + 1, match.end()
    return line, at - (last or 0)


def _fault(place: Place, problem: str, remedy: str = "") -> DiagramError:
    return DiagramError([Fault(place, "", problem, remedy)])


def _place(before: str, name: str) -> Place:
    """Return the place after the beginning ``before`` of a text; every kind of line break counts once."""
    lines = re.split("\r\n|\r|\n", before)
    return Place(name, len(lines), len(lines[-1].removeprefix("\ufeff")) + 1)


def dump_yaml(data: Any) -> str:
    """Return plain data as YAML that `parse_yaml` reads back to equal data."""
    try:
        text = yaml.dump(data, None, _Writer, sort_keys=False, allow_unicode=True, default_flow_style=None)
    except (yaml.YAMLError, UnicodeError):
        problem = "these data cannot be written as YAML: they hold more than texts, numbers, lists and maps"
        raise QuadvisError(problem) from None
    return str(text)


class _Writer(_Dumper):  # type: ignore[misc]
    def ignore_aliases(self, data: Any) -> bool:
        return True


def _write_text(writer: Any, text: str) -> Any:
    """Put quotes around a text that looks like a number or a truth value."""
    looks = plain_value(text)
    style = '"' if "\n" in text else "'" if not isinstance(looks, str) else None
    return writer.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Writer.add_representer(str, _write_text)
