"""Reading YAML files that may be wrong or hostile: located faults, bounded cost, no types guessed.

Nodes are composed from the event stream of PyYAML's C parser, without recursion. The loaders of PyYAML are
not used: they die on deep nesting, expand aliases without bound, and forget duplicate keys and places.
"""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Iterator
from typing import Any

import yaml

from quadvis.errors import DiagramError, Fault, Faults, Place, QuadvisError, closest, quoted
from quadvis.nodes import Mapping, Node, Scalar, Sequence, measure, plain_value

__all__ = ["Mapping", "Node", "Scalar", "Sequence", "dump_yaml", "measure", "parse_yaml", "read_yaml"]

MAX_BYTES = 1_000_000
MAX_NODES = 100_000
MAX_DEPTH = 50
MAX_KEY = 200

_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_Dumper: Any = getattr(yaml, "CSafeDumper", yaml.SafeDumper)

# Control characters; line breaks that editors do not count; signs that reorder the text that people see.
_FORBIDDEN = re.compile(
    "[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069\ud800-\udfff\ufeff"
    "\ufffe\uffff]"
)

# Directives, of which libyaml compares each with all before it.
_DIRECTIVE = re.compile("(?:^|[\r\n])%")

# An element of a signal, which ends a text inside {...} and [...].
_INDEXED = re.compile(r"(?P<name>[^\s{}\[\],:'\"]+)\[[^\[\]{}'\"]*\]")

# PyYAML's words (of libyaml and of its Python parser) and ours; {opened} is the line where the part began.
_PLAIN_WORDS = (
    ("mapping values are not allowed", "a ':' stands where none can",
     "put a text that holds ': ' in quotes, or check the indentation"),
    ("could not find expected ':'", "a key has no ':' after it", "write 'key: value'"),
    ("end of stream", "the quotes opened in line {opened} are never closed", "close them"),
    ("document separator", "the quotes opened in line {opened} are never closed", "close them"),
    ("document indicator", "the quotes opened in line {opened} are never closed", "close them"),
    ("',' or '}'", "the map opened in line {opened} lacks a ',' or its '}}' here", "add it"),
    ("',' or ']'", "the list opened in line {opened} lacks a ',' or its ']' here", "add it"),
    ("did not find expected key", "this does not belong to the map that began in line {opened}",
     "check the indentation, and that quotes are closed"),
    ("did not find expected '-'", "this does not belong to the list that began in line {opened}",
     "begin it with '- ', or check the indentation"),
    ("expected <block end>", "this does not belong to what began in line {opened}", "check the indentation"),
    ("sequence entries", "a '- ' stands where no list can begin", "begin the list on its own line"),
    ("mapping keys are not allowed", "a '? ' stands where none can", "put the text in quotes"),
    ("unknown escape character", "the text in double quotes holds an unknown escape after '\\'",
     "write '\\\\', or use single quotes"),
    ("cannot start any token", "a text cannot begin with this character", "put the text in quotes"),
    ("alphabetic or numeric", "a text cannot begin with '*' or '&'", "put the text in quotes"),
    ("document start", "this does not belong to the document", "check the indentation"),
    ("document content", "a value is missing", "write one"),
    ("node content", "a value is missing", "write one"),
    ("comment or line break", "this does not belong behind '|' or '>'", "begin the text on the next line"),
    ("chomping or indentation", "this does not belong behind '|' or '>'", "begin the text on the next line"),
    ("tag", "a tag ('!') is not allowed", "put a text that begins with '!' in quotes"),
)  # fmt: skip


def read_yaml(path: str | os.PathLike[str], faults: Faults | None = None) -> Node:
    """Read a YAML file of at most 1 MB; see `parse_yaml`. Everything that is wrong raises `DiagramError`."""
    name = os.fspath(path)
    try:
        if not stat.S_ISREG(os.stat(name).st_mode):
            raise _fault(Place(name), "this is not a file", "name a YAML file")
        with open(name, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except FileNotFoundError:
        raise _fault(Place(name), "there is no such file", _similar_file(name)) from None
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise _fault(Place(name), f"the file cannot be read: {reason}") from None
    if len(data) > MAX_BYTES:
        raise _fault(Place(name, 1, 1), f"the file is larger than {MAX_BYTES // 1000} kB", "split it")
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        place = _place(data[: error.start].decode("utf-8"), name)
        raise _fault(place, "the file is not UTF-8 text", "save it with the encoding UTF-8") from None
    return parse_yaml(text, name, faults)


def parse_yaml(text: str, name: str = "<text>", faults: Faults | None = None) -> Node:
    """Return the root node of one YAML document.

    Aliases, anchors, merge keys, tags, duplicate keys, keys that are no texts, and all that exceeds the
    limits above are refused. With `faults`, what leaves the rest readable is kept there and the rest is
    returned; a text that is no YAML always raises `DiagramError`.
    """
    text = text.removeprefix("\ufeff")
    if len(text) > MAX_BYTES:
        raise _fault(Place(name, 1, 1), f"the text is larger than {MAX_BYTES // 1000} kB", "split it")
    bad = _FORBIDDEN.search(text)
    if bad is not None:
        raise _fault(_place(text[: bad.start()], name), *_control_character(bad))
    directive = _DIRECTIVE.search(text)
    if directive is not None:
        place = _place(text[: directive.end() - 1], name)
        raise _fault(place, "a line that begins with '%' is not allowed", "leave it out")
    found = Faults() if faults is None else faults
    try:
        root = _Composer(name, found).compose(yaml.parse(text, Loader=_Loader))
    except yaml.MarkedYAMLError as error:
        raise DiagramError([*found, _in_plain_words(error, text, name)]) from None
    except yaml.YAMLError as error:
        raise _fault(Place(name, 1, 1), f"this is not YAML: {quoted(error, 200)}") from None
    if faults is None:
        found.check()
    return root


class _Composer:
    """Builds nodes from events, on a stack of its own."""

    def __init__(self, name: str, faults: Faults) -> None:
        self.name, self.faults = name, faults
        self.stack: list[Sequence | Mapping] = []
        self.keys: list[Scalar | None] = []  # one per open collection: the key that waits for its value
        self.root: Node | None = None
        self.documents = self.nodes = 0

    def compose(self, events: Iterator[Any]) -> Node:
        """Return the root; raise if there is none."""
        for event in events:
            kind = type(event)
            if kind is yaml.ScalarEvent:
                self._add(Scalar(event.value, not event.style, *self._position(event)), event)
            elif kind is yaml.MappingStartEvent:
                self._open(Mapping({}, {}, *self._position(event)), event)
            elif kind is yaml.SequenceStartEvent:
                self._open(Sequence([], *self._position(event)), event)
            elif kind is yaml.MappingEndEvent or kind is yaml.SequenceEndEvent:
                self.stack.pop()
                self.keys.pop()
            elif kind is yaml.AliasEvent:
                self._refuse(event, f"the alias {quoted('*' + event.anchor)} is not allowed", "write it out")
                self._add(Scalar("", True, *self._position(event)), event)
            elif kind is yaml.DocumentStartEvent:
                self.documents += 1
                if self.documents > 1:
                    raise self._fatal(event, "a second document begins here", "keep one document in a file")
        if self.root is None or (isinstance(self.root, Scalar) and self.root.plain and not self.root.value):
            raise DiagramError([*self.faults, Fault(Place(self.name, 1, 1), "", "the file is empty")])
        return self.root

    def _position(self, event: Any) -> tuple[str, int, int]:
        mark = event.start_mark
        return self.name, mark.line + 1, mark.column + 1

    def _refuse(self, event: Any, problem: str, remedy: str) -> None:
        self.faults.add(Place(*self._position(event)), problem, remedy)

    def _fatal(self, event: Any, problem: str, remedy: str) -> DiagramError:
        return DiagramError([*self.faults, Fault(Place(*self._position(event)), "", problem, remedy)])

    def _open(self, node: Sequence | Mapping, event: Any) -> None:
        self._add(node, event)
        if len(self.stack) >= MAX_DEPTH:
            raise self._fatal(event, f"this is nested deeper than {MAX_DEPTH} levels", "write it flatter")
        self.stack.append(node)
        self.keys.append(None)

    def _add(self, node: Node, event: Any) -> None:
        """Put a node where it belongs: below the waiting key, at the end of the list, or as a key itself."""
        self.nodes += 1
        if self.nodes > MAX_NODES:
            raise self._fatal(event, f"the file holds more than {MAX_NODES} values", "split it")
        self._check_properties(event)
        if not self.stack:
            self.root = node
            return
        parent = self.stack[-1]
        if isinstance(parent, Sequence):
            node.key = f"{parent.key}[{len(parent.values)}]"
            parent.values.append(node)
            return
        key = self.keys[-1]
        if key is None:
            self.keys[-1] = self._key(parent, node, event)
        else:
            if key is not _NO_KEY:
                node.key = key.value
                parent.keys[key.value], parent.values[key.value] = key, node
            self.keys[-1] = None

    def _check_properties(self, event: Any) -> None:
        escaped = _FORBIDDEN.search(event.value) if getattr(event, "style", "") == '"' else None
        if escaped is not None:
            self._refuse(event, *_control_character(escaped))
        if event.anchor is not None and type(event) is not yaml.AliasEvent:
            self._refuse(event, f"the anchor {quoted('&' + event.anchor)} is not allowed", "leave it out")
        if getattr(event, "tag", None) is not None:
            remedy = "leave it out, or put a text that begins with '!' in quotes"
            tag = event.tag.replace("tag:yaml.org,2002:", "!!")
            self._refuse(event, f"the tag {quoted(tag)} is not allowed", remedy)

    def _key(self, parent: Mapping, node: Node, event: Any) -> Scalar:
        """Return the key to put the next value under, `_NO_KEY` if it is refused."""
        if type(event) is yaml.AliasEvent:
            return _NO_KEY
        problem, remedy = _wrong_key(parent, node)
        if isinstance(node, Scalar) and not problem:
            return node
        self._refuse(event, problem, remedy)
        return _NO_KEY


def _wrong_key(parent: Mapping, node: Node) -> tuple[str, str]:
    """Return what is wrong with a key, and what would be right; nothing if it will do."""
    if not isinstance(node, Scalar):
        return "a key must be a text", "put a text that begins with '{' or '[' in quotes"
    if not node.value:
        return "a key is missing before ':'", "write 'key: value'"
    if len(node.value) > MAX_KEY:
        return f"the key {quoted(node.value)} is longer than {MAX_KEY} characters", "shorten it"
    if node.value == "<<" and node.plain:
        return "the merge key '<<' is not allowed", "write the values out"
    if node.value in parent.keys:
        line = parent.keys[node.value].line
        return f"key {quoted(node.value)} is already in line {line}", "keep one of them"
    return "", ""


_NO_KEY = Scalar("", True, "", 0, 0)


def _fault(place: Place, problem: str, remedy: str = "") -> DiagramError:
    return DiagramError([Fault(place, "", problem, remedy)])


def _control_character(found: re.Match[str]) -> tuple[str, str]:
    return f"the control character U+{ord(found.group()):04X} is not allowed", "remove it"


def _place(before: str, name: str) -> Place:
    """Return the place after a beginning of the text; every kind of line break counts once."""
    lines = re.split("\r\n|\r|\n", before)
    return Place(name, len(lines), len(lines[-1].removeprefix("\ufeff")) + 1)


def _similar_file(name: str) -> str:
    folder, file = os.path.split(name)
    try:
        near = closest(file, sorted(os.listdir(folder or "."))[:1000])
    except (OSError, ValueError):
        near = None
    return f"did you mean {quoted(os.path.join(folder, near), 200)}?" if near else ""


def _in_plain_words(error: yaml.MarkedYAMLError, text: str, name: str) -> Fault:
    """Return PyYAML's complaint as one sentence that says what to do."""
    problem = error.problem or error.context or "no reason given"
    mark = error.problem_mark or error.context_mark
    if mark is None:
        return Fault(Place(name, 1, 1), "", f"this is not YAML: {quoted(problem, 200)}")
    opened = error.context_mark or mark
    source = re.split("\r\n|\r|\n", text)
    ended = not "".join(source[mark.line : mark.line + 1])[mark.column :] and mark.line >= len(source) - 1
    at = opened if ended else mark
    place = Place(name, at.line + 1, at.column + 1)
    indent = source[at.line][: at.column + 1] if at.line < len(source) else ""
    if "\t" in indent and not indent.strip():
        return Fault(place, "", "a tab cannot indent a line", "use spaces")
    line = source[at.line] if at.line < len(source) and "',' or" in problem else ""
    for indexed in _INDEXED.finditer(line):
        if indexed.end("name") == at.column:
            place = Place(name, at.line + 1, indexed.start() + 1)
            return Fault(place, "", "a text with '[' needs quotes here", f'write "{indexed.group()}"')
    for words, wrong, right in _PLAIN_WORDS:
        if words in problem:
            return Fault(place, "", wrong.format(opened=opened.line + 1), right)
    return Fault(place, "", f"this is not YAML: {quoted(problem, 200)}")


def dump_yaml(data: Any) -> str:
    """Return plain data as YAML that `parse_yaml` reads back to the same."""
    try:
        text = yaml.dump(data, None, _Writer, sort_keys=False, allow_unicode=True, default_flow_style=None)
    except (yaml.YAMLError, UnicodeError) as error:
        raise QuadvisError(f"these data cannot be written as YAML: {error}") from None
    return str(text)


class _Writer(_Dumper):  # type: ignore[misc]
    def ignore_aliases(self, data: Any) -> bool:
        return True


def _write_text(writer: Any, text: str) -> Any:
    """Put quotes around a text that would read as a number or a truth value."""
    looks = plain_value(text)
    style = '"' if "\n" in text else "'" if not isinstance(looks, str) else None
    return writer.represent_scalar("tag:yaml.org,2002:str", text, style=style)


_Writer.add_representer(str, _write_text)
