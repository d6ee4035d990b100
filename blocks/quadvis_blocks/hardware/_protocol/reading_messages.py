"""Reads the messages of a protocol's file."""

from __future__ import annotations

from dataclasses import replace

from quadvis.document import YamlMap, YamlNode, YamlScalar
from quadvis.errors import Faults, quoted, suggestion
from quadvis_blocks.hardware._protocol.bytes_written import bytes_of, whole_number
from quadvis_blocks.hardware._protocol.checksums import (
    AMBIGUOUS,
    NAMES,
    NONE,
    Algorithm,
    Crc,
    algorithm,
)
from quadvis_blocks.hardware._protocol.description import (
    ALL,
    BODY,
    LONGEST,
    Check,
    CounterField,
    FixedBytes,
    FrameId,
    ProtocolMessage,
    ValueField,
    WireField,
)
from quadvis_blocks.hardware._protocol.forms import BITS, ORDERS
from quadvis_blocks.hardware._protocol.reading_fields import LengthField, ReadField, is_text_field

REQUIRED = ("fields", "checksum")
OPTIONAL = ("doc", "header", "terminator", "separator", "order", "request", "id", "extended")
CHECK_KEYS = ("over", "order", "mark", "width", "polynomial", "initial", "reflected", "final")
CRC = "crc"
MARK = b"*"
MOST_FIELDS = 200
CAN_BYTES = 8  # of a frame
PRINTABLE, TAB = range(0x20, 0x7F), 9


def read_message(name: str, node: YamlNode, order: YamlNode | None, faults: Faults) -> ProtocolMessage | None:
    """Return a message; None after adding its faults. ``order`` is that of the protocol, if it has one."""
    given = faults.collect(node.fields, REQUIRED, OPTIONAL, faults)
    if given is None or not all(key in given for key in REQUIRED):
        return None
    return _Reader(name, given, given.get("order") or order, faults).message()


class _Reader:
    """Reads one message."""

    def __init__(self, name: str, given: YamlMap, order: YamlNode | None, faults: Faults) -> None:
        self.name, self.given, self.faults = name, given, faults
        self.before = len(faults)
        self.order = faults.collect(order.choice, ORDERS) if order is not None else None
        self.items = faults.collect(given["fields"].items) or []
        self.text = [node for node in self.items if is_text_field(node)]
        self.text += [given.keys["separator"]] if "separator" in given else []
        self.is_text = bool(self.text)

    def message(self) -> ProtocolMessage | None:
        """Return the message; None if there was a fault."""
        given = self.given
        bytewise = [node for node in self.items if isinstance(node, YamlMap) and "type" in node]
        if self.is_text and bytewise:
            problem = f"this belongs to a line of text, and the field in line {bytewise[0].line} to bytes"
            self.faults.add(self.text[0].place, problem, "a message is one or the other")
            return None
        if len(self.items) > MOST_FIELDS:
            self.faults.append(given["fields"].wrong(f"a list of at most {MOST_FIELDS} fields").faults[0])
            return None
        fields = self._fields()
        header, terminator, separator = (self._bytes(key) for key in ("header", "terminator", "separator"))
        if self.is_text and not terminator:
            problem = "a line of text needs a terminator"
            self.faults.add(given.place, problem, "write such as terminator: '\\r\\n'")
        check = self._check(given["checksum"])
        request, doc = self._bytes("request"), given.get("doc")
        text = "" if doc is None else self.faults.collect(doc.text) or ""
        if len(self.faults) > self.before:
            return None
        made = ProtocolMessage(
            self.name, self.is_text, header, (), check, terminator, text, request, place=given.place
        )
        whole = replace(made, fields=self._laid_out(fields, separator, made))
        return self._checked(replace(whole, frame_id=self._frame_id(whole)))

    def _frame_id(self, message: ProtocolMessage) -> FrameId | None:
        """Return the identifier of a frame on a CAN bus; None if the message has none."""
        given = self.given
        if "id" not in given:
            if "extended" in given:
                self.faults.add(given.keys["extended"].place, "'extended' belongs to an 'id'", "give it")
            return None
        for key in ("header", "terminator", "separator", "request"):
            if key in given:
                self.faults.add(given.keys[key].place, f"a frame with an id has no '{key}'", "leave it out")
        extended = self.faults.collect(given["extended"].boolean) if "extended" in given else False
        number = self.faults.collect(whole_number, given["id"])
        bits = 29 if extended else 11
        if number is not None and not 0 <= number < 1 << bits:
            remedy = "" if extended or number < 0 else "write 'extended: true' for one of 29 bits"
            self.faults.append(given["id"].wrong(f"a whole number of {bits} bits", remedy).faults[0])
        if message.is_text or message.size > CAN_BYTES:
            problem = f"a frame with an id has {CAN_BYTES} bytes at most, and no text"
            self.faults.add(given["fields"].place, problem, f"these are {message.size} bytes")
        return FrameId(number or 0, bool(extended))

    def _bytes(self, key: str) -> bytes:
        node = self.given.get(key)
        found = None if node is None else self.faults.collect(bytes_of, node)
        if node is not None and not found and found is not None:
            self.faults.add(node.place, f"'{key}' is empty", "leave it out")
        ends = key == "terminator"
        odd = (
            self.is_text
            and key != "request"
            and any(byte not in PRINTABLE and byte != TAB and not ends for byte in found or b"")
        )
        if node is not None and odd:
            self.faults.add(node.place, f"'{key}' of a line of text must be printable ASCII")
        return found or b""

    def _fields(self) -> list[WireField | LengthField]:
        read = ReadField(self.is_text, self.order, self.faults)
        found = [self.faults.collect(read.field, item) for item in self.items]
        taken: dict[str, int] = {}
        for node, each in zip(self.items, found, strict=True):
            for value in read.named(each):
                if value.name in taken:
                    problem = f"the name {quoted(value.name)} is already in line {taken[value.name]}"
                    self.faults.add(value.place, problem, "choose another one")
                taken.setdefault(value.name, value.place.line or node.line)
        if sum(isinstance(each, CounterField) for each in found) > 1:
            self.faults.add(self.given["fields"].place, "a message has one counter at most")
        return [each for each in found if each is not None]

    def _laid_out(
        self, fields: list[WireField | LengthField], separator: bytes, made: ProtocolMessage
    ) -> tuple[WireField, ...]:
        """Return the fields with what stands between them, and with the lengths, which are now known."""
        if self.is_text:
            found: list[WireField] = []
            for each in fields:
                assert not isinstance(each, LengthField)
                between = FixedBytes(separator) if found and separator else None
                found += [between] if between is not None else []
                found.append(replace(each, between=separator) if isinstance(each, ValueField) else each)
            return tuple(found)
        blank = [FixedBytes(bytes(each.size)) if isinstance(each, LengthField) else each for each in fields]
        whole = replace(made, fields=tuple(blank)).size
        sizes = [each.size for each in blank]
        for place, each in enumerate(fields):
            if isinstance(each, LengthField):
                counted = {"after": sum(sizes[place + 1 :]), BODY: sum(sizes), ALL: whole}[each.counts]
                blank[place] = FixedBytes(each.written(counted, self.faults))
        return tuple(blank)

    def _checked(self, message: ProtocolMessage) -> ProtocolMessage | None:
        place = self.given["fields"].place
        if message.size > LONGEST:
            self.faults.add(place, f"a message of {message.size} bytes is too long", f"{LONGEST} can be read")
        if message.is_text:
            self._check_separated(message)
            self._check_text(message)
        return None if len(self.faults) > self.before else message

    def _check_text(self, message: ProtocolMessage) -> None:
        """Refuse text with bytes that do not show, and a terminator that stands inside, too."""
        fixed = [each.data for each in message.fields if isinstance(each, FixedBytes)]
        marks = [message.check.mark] if message.check is not None else []
        if any(byte not in PRINTABLE and byte != TAB for piece in (*fixed, *marks) for byte in piece):
            self.faults.add(
                self.given["fields"].place, "what stands in a line of text must be printable ASCII"
            )
        if message.terminated_inside:
            problem = "the terminator could stand inside the message, too"
            self.faults.add(self.given["terminator"].place, problem, "choose the byte by which a line ends")

    def _check_separated(self, message: ProtocolMessage) -> None:
        """Refuse two numbers in text between which nothing stands: nobody could tell where one ends."""
        for one, other in zip(message.fields, message.fields[1:], strict=False):
            if not isinstance(one, FixedBytes) and not isinstance(other, FixedBytes):
                problem = "nothing stands between two fields of text"
                self.faults.add(self.given["fields"].place, problem, "write such as separator: ','")
                return
        for each in message.fields:
            if isinstance(each, ValueField) and each.value.elements > 1 and not each.between:
                problem = f"nothing stands between the elements of {quoted(each.value.name)}"
                self.faults.add(each.value.place, problem, "write such as separator: ','")

    def _check(self, node: YamlNode) -> Check | None:
        """Return the checksum; None if it says that there is none, or after adding its faults."""
        if isinstance(node, YamlScalar):
            if node.value == NONE:
                return None
            found = self.faults.collect(_algorithm, node)
            return None if found is None else self._placed(found, node, {})
        given = self.faults.collect(node.fields, ("kind",), CHECK_KEYS, self.faults)
        if given is None or "kind" not in given:
            return None
        if given["kind"].to_python() == CRC:
            made = self._own_crc(given)
        else:
            made = self.faults.collect(_algorithm, given["kind"])
            for key in CHECK_KEYS[3:]:
                if key in given:
                    remedy = f"leave it out, or write kind: {CRC}"
                    self.faults.add(given.keys[key].place, f"'{key}' belongs to a CRC of your own", remedy)
        return None if made is None else self._placed(made, node, dict(given.values))

    def _placed(self, made: Algorithm, node: YamlNode, given: dict[str, YamlNode]) -> Check:
        over = BODY
        if "over" in given:
            over = self.faults.collect(given["over"].choice, (BODY, ALL)) or BODY
        order = self.faults.collect(given["order"].choice, ORDERS) if "order" in given else self.order
        mark = self.faults.collect(bytes_of, given["mark"]) if "mark" in given else MARK
        if self.is_text:
            return Check(made, over, mark=mark or b"")
        if "mark" in given:
            self.faults.add(given["mark"].place, "'mark' belongs to text", "leave it out")
        if made.size > 1 and order is None:
            problem = "the order of the checksum's bytes is missing"
            self.faults.add(node.place, problem, "write 'order: little' or 'order: big'")
        return Check(made, over, order or ORDERS[0])

    def _own_crc(self, given: YamlMap) -> Algorithm | None:
        read = self.faults.collect
        for key in ("width", "polynomial"):
            if key not in given:
                self.faults.add(given.place, f"key '{key}' is missing", f"add '{key}: ...'")
        width = read(_width, given["width"]) if "width" in given else None
        if width is None or "polynomial" not in given:
            return None
        numbers = {
            key: read(_below, given[key], width) for key in ("polynomial", "initial", "final") if key in given
        }
        reflected = read(given["reflected"].boolean) if "reflected" in given else False
        if None in numbers.values() or reflected is None:
            return None
        whole = {key: value for key, value in numbers.items() if value is not None}
        return Algorithm(CRC, Crc(width, reflected=reflected, **whole))


def _algorithm(node: YamlNode) -> Algorithm:
    name = node.text()
    if name in NAMES:
        return algorithm(name)
    if name in AMBIGUOUS:
        problem = f"{quoted(name)} is the name of several checksums"
        raise node.fault(problem, f"write {' or '.join(AMBIGUOUS[name])}, as the device's manual says")
    remedy = suggestion(name, (*NAMES, NONE)) or f"write {NONE}, {', '.join(NAMES)}, or {{kind: {CRC}, ...}}"
    raise node.fault(f"there is no checksum {quoted(name)}", remedy)


def _width(node: YamlNode) -> int:
    width = whole_number(node)
    if width % BITS or not 0 < width <= 64:
        raise node.wrong("8, 16, 24, 32 ... or 64 bits")
    return width


def _below(node: YamlNode, width: int) -> int:
    number = whole_number(node)
    if not 0 <= number < 1 << width:
        raise node.wrong(f"a whole number of {width} bits")
    return number
