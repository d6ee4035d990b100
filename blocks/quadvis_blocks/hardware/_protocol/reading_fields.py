"""Reads the fields of a message of a protocol's file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

from quadvis.document import YamlMap, YamlNode, YamlScalar
from quadvis.errors import Faults, Place, quoted
from quadvis.units import Unit
from quadvis_blocks.hardware._protocol.bytes_written import bytes_of, whole_number
from quadvis_blocks.hardware._protocol.description import (
    ALL,
    BODY,
    BitField,
    BitRun,
    CounterField,
    FixedBytes,
    IgnoredField,
    NamedValue,
    ValueField,
    WireField,
)
from quadvis_blocks.hardware._protocol.forms import BITS, CODES, ORDERS, Binary, Form, Printed, printed

TEXT = "text"
TYPES = tuple(CODES)
FORM = ("type", "format", "order")
SCALED = ("unit", "doc", "scale", "offset", "range")
VALUE = (*FORM, *SCALED, "elements", "words", "optional")
# The keys of a field by the one that says what it is.
KINDS = {
    "name": VALUE,
    "bits": ("type", "order"),
    "counts": ("type", "order", "plus"),
    "counter": FORM,
    "ignore": (),
}
AFTER = "after"
MOST = 256  # elements, bytes that are ignored
LONGEST_WORD = 32


class LengthField(NamedTuple):
    """A number that says how many bytes a message has, or a piece of it; ``counts`` is after, body or all."""

    form: Binary
    counts: str
    plus: int
    place: Place

    @property
    def size(self) -> int:
        """Its bytes."""
        return self.form.size

    def written(self, count: int, faults: Faults) -> bytes:
        """Return its bytes; a fault if the count does not fit."""
        low, high = self.form.limits
        number = count + self.plus
        if not low <= number <= high:
            faults.add(self.place, f"the length {number} does not fit {self.form.type}", "use a wider type")
            return bytes(self.size)
        return number.to_bytes(self.size, "little" if self.form.order == ORDERS[0] else "big")


def is_text_field(node: YamlNode) -> bool:
    """Return whether a field as it is written belongs to a line of text."""
    if not isinstance(node, YamlMap):
        return False
    ignored = node.get("ignore")
    return "format" in node or "words" in node or (ignored is not None and ignored.to_python() == TEXT)


class ReadField:
    """Reads fields, one after the other; a fault is raised, or added if more may follow in the same field.

    ``order`` is that of the message's bytes; None if neither it nor the protocol has one.
    """

    def __init__(self, is_text: bool, order: str | None, faults: Faults) -> None:
        self.is_text, self.order, self.faults = is_text, order, faults

    def field(self, node: YamlNode) -> WireField | LengthField:
        """Return a field."""
        if not isinstance(node, YamlMap):
            return FixedBytes(bytes_of(node))
        kind = next((key for key in KINDS if key in node), "")
        if not kind:
            raise node.fault("the field has no name", "add 'name: ...', or write {ignore: 2} for two bytes")
        node = node.fields((kind,), KINDS[kind], self.faults)
        if self.is_text and kind in ("bits", "counts"):
            raise node.fault(f"'{kind}' does not go into a line of text", "describe it as another message")
        if kind == "bits":
            return self._bits(node)
        if kind == "counts":
            return self._length(node)
        if kind == "counter":
            return self._counter(node)
        return self._ignored(node["ignore"]) if kind == "ignore" else self._value(node)

    @staticmethod
    def named(each: WireField | LengthField | None) -> Iterator[NamedValue]:
        """Yield the values of a field."""
        if isinstance(each, ValueField):
            yield each.value
        elif isinstance(each, BitField):
            yield from (run.value for run in each.runs if run.value is not None)

    def _form(self, node: YamlMap) -> Form:
        """Return how a field's number stands on the wire."""
        if self.is_text:
            return self._format(node)
        if "type" not in node:
            raise node.fault("the type of the field is missing", "add such as 'type: f32', or 'format: %.3f'")
        kind = node["type"].choice(TYPES)
        return Binary(kind, self._order(node, kind))

    def _order(self, node: YamlMap, kind: str) -> str:
        order = node["order"].choice(ORDERS) if "order" in node else self.order
        if order is None and int(kind[1:]) > BITS:
            remedy = "write 'order: little' or 'order: big', here, in the message or in the protocol"
            raise node.fault(f"the order of the bytes of this {kind} is missing", remedy)
        return order or ORDERS[0]

    def _format(self, node: YamlMap) -> Printed:
        if "format" not in node:
            if "words" in node:
                return Printed("%d")
            raise node.fault("the format of the field is missing", "add such as 'format: %.3f'")
        try:
            return printed(node["format"].text())
        except ValueError:
            raise node["format"].wrong("a format of one number, such as %.3f, %d or %04X") from None

    def _value(self, node: YamlMap) -> ValueField:
        form = self._form(node)
        elements = _bounded(node["elements"], 1, MOST) if "elements" in node else 0
        words = self._words(node["words"]) if "words" in node else {}
        optional = node["optional"].boolean() if "optional" in node else False
        if words and (elements or "format" in node):
            raise node["words"].fault("words stand for one number without a format", "leave the other out")
        if optional and (elements or not self.is_text):
            raise node["optional"].fault("only one number in text may be missing", "leave 'optional' out")
        fits = not isinstance(form, Binary) or form.type != "u64"
        value = self._named(node, form.is_whole and fits and not optional)
        return ValueField(form, replace(value, elements=elements, words=words, optional=optional))

    def _named(self, node: YamlMap, is_whole: bool) -> NamedValue:
        name = node["name"].name()
        unit = node["unit"].unit() if "unit" in node else Unit()
        if unit.variables:
            raise node["unit"].wrong("a unit")
        scale = node["scale"].number() if "scale" in node else 1.0
        offset = node["offset"].quantity(unit) if "offset" in node else 0.0
        if scale == 0.0:
            raise node["scale"].wrong("a number other than 0")
        low = high = None
        if "range" in node:
            low, high = (bound * unit.scale for bound in _range(node["range"], unit))
        doc = node["doc"].text() if "doc" in node else ""
        is_plain = is_whole and scale == 1.0 and offset == 0.0 and not unit.dimension and unit.scale == 1.0
        return NamedValue(
            name, unit.si, doc, factor=scale * unit.scale, shift=offset * unit.scale, lowest=low,
            highest=high, whole=is_plain, place=node["name"].place,
        )  # fmt: skip

    def _words(self, node: YamlNode) -> dict[bytes, int]:
        found: dict[bytes, int] = {}
        for key, value in node.mapping().pairs():
            if not key.value.isascii() or not key.value.isprintable() or len(key.value) > LONGEST_WORD:
                raise key.wrong(f"a word of at most {LONGEST_WORD} printable ASCII characters")
            found[key.value.encode()] = value.integer()
        if not found:
            raise node.wrong("words and their numbers, such as {A: 1, V: 0}")
        return found

    def _bits(self, node: YamlMap) -> BitField:
        kind = (
            node["type"].choice(tuple(each for each in TYPES if each.startswith("u")))
            if "type" in node
            else ""
        )
        if not kind:
            raise node.fault("the type of the field is missing", "add such as 'type: u16'")
        form = Binary(kind, self._order(node, kind))
        runs = [self._run(each) for each in node["bits"].items()]
        given = sum(run.width for run in runs)
        if given > form.size * BITS:
            problem = f"these are {given} bits, and {kind} has {form.size * BITS}"
            raise node["bits"].fault(problem, "use a wider type")
        return BitField(form, tuple(runs))

    def _run(self, node: YamlNode) -> BitRun:
        if "width" not in node.mapping():
            raise node.fault("the width of these bits is missing", "add such as 'width: 3'")
        keys = node.fields(("width",), ("name", "signed", *SCALED), self.faults)
        width = _bounded(keys["width"], 1, 64)
        signed = keys["signed"].boolean() if "signed" in keys else False
        value = self._named(keys, width < 64) if "name" in keys else None
        return BitRun(width, value, signed)

    def _length(self, node: YamlMap) -> LengthField:
        form = self._form(node)
        assert isinstance(form, Binary)
        counts = node["counts"].choice((AFTER, BODY, ALL))
        plus = whole_number(node["plus"]) if "plus" in node else 0
        if not form.is_whole or form.type.startswith("i"):
            raise node["type"].wrong("u8, u16, u32 or u64")
        return LengthField(form, counts, plus, node.place)

    def _counter(self, node: YamlMap) -> CounterField:
        form = self._form(node)
        low, high = form.limits
        if not form.is_whole or (low < 0 and isinstance(form, Binary)):
            raise node.fault("a counter is a whole number without sign", "write such as 'type: u8'")
        modulus = _bounded(node["counter"], 2, 1 << 62)
        if modulus - 1 > high:
            raise node["counter"].fault(
                f"a counter to {modulus - 1} does not fit its type", "use a wider one"
            )
        return CounterField(form, modulus)

    def _ignored(self, node: YamlNode) -> IgnoredField:
        if node.to_python() == TEXT and self.is_text:
            return IgnoredField()
        if self.is_text:
            raise node.wrong(f"'{TEXT}' in a line of text")
        return IgnoredField(_bounded(node, 1, MOST))


def _bounded(node: YamlNode, low: int, high: int) -> int:
    value = whole_number(node) if isinstance(node, YamlScalar) else node.integer()
    if not low <= value <= high:
        raise node.wrong(f"a whole number from {low} to {high}")
    return value


def _range(node: YamlNode, unit: Unit) -> tuple[float, float]:
    bounds = node.items()
    if len(bounds) != 2:
        raise node.wrong("two numbers, such as [-180, 180]", found=f"{len(bounds)} of them")
    low, high = (bound.quantity(unit) for bound in bounds)
    if not low < high:
        raise node.wrong("two numbers, the lower one first", found=quoted(f"[{low:g}, {high:g}]"))
    return low, high
