"""XML from anybody, as plain elements: without document types and entities, and within limits."""

from __future__ import annotations

from typing import Any
from xml.parsers import expat

from quadvis.errors import QuadvisError, quoted

MOST_ELEMENTS = 2_000_000
DEEPEST = 40
LONGEST_TEXT = 20_000_000  # characters between tags, all together
IGNORED = ("VendorAnnotations", "Annotations")  # elements whose contents are other programs' business


class MarkupError(QuadvisError):
    """A text that is no XML, or more than is read; the sentence has the line."""


class Element:
    """An element: its name, its attributes, its children, and the line in which it begins."""

    __slots__ = ("attributes", "children", "line", "name")

    def __init__(self, name: str, attributes: dict[str, str], line: int) -> None:
        self.name, self.attributes, self.line = name, attributes, line
        self.children: list[Element] = []

    def child(self, name: str) -> Element | None:
        """Return the first child of that name."""
        return next((each for each in self.children if each.name == name), None)

    def all(self, *names: str) -> list[Element]:
        """Return the children along a path of names: those of the last name."""
        found = [self]
        for name in names:
            found = [child for each in found for child in each.children if child.name == name]
        return found


def read_markup(data: bytes) -> Element:
    """Return the root of an XML text; MarkupError if it is none, or more than the limits allow."""
    reader = _Reader()
    try:
        reader.parser.Parse(data, True)
    except expat.ExpatError as error:
        what = expat.ErrorString(error.code) or "it is no XML"
        raise MarkupError(f"line {error.lineno}: {what}") from None
    except (LookupError, ValueError) as error:  # an encoding that is none
        raise MarkupError(f"its encoding cannot be read ({quoted(str(error), 80)})") from None
    assert reader.root is not None
    return reader.root


class _Reader:
    """Takes what the parser finds."""

    def __init__(self) -> None:
        self.root: Element | None = None
        self._open: list[Element] = []
        self._count = self._text = self._ignored = 0
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.CharacterDataHandler = self._characters
        self.parser.StartDoctypeDeclHandler = self._refuse_type
        self.parser.EntityDeclHandler = self._refuse_type

    def _refuse(self, why: str) -> MarkupError:
        return MarkupError(f"line {self.parser.CurrentLineNumber}: {why}")

    def _start(self, name: str, attributes: dict[str, str]) -> None:
        self._count += 1
        if self._count > MOST_ELEMENTS:
            raise self._refuse(f"there are more than {MOST_ELEMENTS} elements")
        if len(self._open) + self._ignored >= DEEPEST:
            raise self._refuse(f"elements are nested deeper than {DEEPEST}")
        if self._ignored or (self._open and name in IGNORED):
            self._ignored += 1
            return
        made = Element(name, attributes, self.parser.CurrentLineNumber)
        if self._open:
            self._open[-1].children.append(made)
        else:
            self.root = made
        self._open.append(made)

    def _end(self, _: str) -> None:
        if self._ignored:
            self._ignored -= 1
        else:
            self._open.pop()

    def _characters(self, text: str) -> None:
        self._text += len(text)
        if self._text > LONGEST_TEXT:
            raise self._refuse(f"there are more than {LONGEST_TEXT} characters between tags")

    def _refuse_type(self, *_: Any) -> None:
        raise self._refuse("a document type or an entity has no place here")
