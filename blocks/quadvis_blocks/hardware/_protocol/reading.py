"""Reads the file of a protocol: every fault in it with its place, all together."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from quadvis.block import Line
from quadvis.document import YamlMap, YamlNode, read_fields
from quadvis.errors import Faults
from quadvis.machine.serial_port import PARITIES
from quadvis.units import Unit
from quadvis_blocks.hardware._protocol.bytes_written import bytes_of, whole_number
from quadvis_blocks.hardware._protocol.description import DeviceProtocol, ProtocolMessage
from quadvis_blocks.hardware._protocol.reading_messages import read_message

FORMAT = 1  # of the file
SECOND = Unit.parse("s")
REQUIRED = ("quadvis", "name", "messages")
OPTIONAL = ("doc", "order", "line", "initialise", "terminate")
LINE_KEYS = ("bits", "parity", "stop_bits", "gap", "dtr", "rts", "settle")
MOST_MESSAGES = 100
LONGEST_SETTLE = 60.0  # s


def read_protocol(path: str | Path) -> DeviceProtocol:
    """Return the protocol that a file describes; `DiagramError` with the place of every fault in it."""
    root = read_fields(path, "the file of a protocol", REQUIRED, OPTIONAL)
    faults = Faults()
    with faults.about(f"protocol '{root['name'].to_python()}'"):
        found = _read(root, faults)
    faults.check()
    return found


def _read(root: YamlMap, faults: Faults) -> DeviceProtocol:
    if faults.collect(root["quadvis"].integer) not in (None, FORMAT):
        raise root["quadvis"].wrong(f"{FORMAT}", "this version of quadvis reads no other format")
    name = faults.collect(root["name"].name) or ""
    doc = root.get("doc")
    return DeviceProtocol(
        name,
        _messages(root, faults),
        _line(root.get("line"), faults),
        _texts(root.get("initialise"), faults),
        _texts(root.get("terminate"), faults),
        "" if doc is None else faults.collect(doc.text) or "",
    )


def _messages(root: YamlMap, faults: Faults) -> Mapping[str, ProtocolMessage]:
    found = {}
    given = faults.collect(root["messages"].mapping)
    if given is not None and not 0 < len(given) <= MOST_MESSAGES:
        raise given.wrong(f"1 to {MOST_MESSAGES} messages by name", found=f"{len(given)} of them")
    for key, node in [] if given is None else given.pairs():
        name = faults.collect(key.name)
        message = read_message(name or "", node, root.get("order"), faults)
        if name is not None and message is not None:
            found[name] = message
    return found


def _texts(node: YamlNode | None, faults: Faults) -> tuple[bytes, ...]:
    """Return messages that are sent as they are written: a list of them, or one."""
    if node is None:
        return ()
    is_several = not isinstance(node.to_python(), str)
    found = [faults.collect(bytes_of, each) for each in (node.items() if is_several else [node])]
    return tuple(each for each in found if each is not None)


def _line(node: YamlNode | None, faults: Faults) -> Line | None:
    if node is None:
        return None
    given = faults.collect(node.fields, ("baud",), LINE_KEYS, faults)
    if given is None:
        return None
    whole = {
        name: faults.collect(_between, given[name], *bounds)
        for name, bounds in {"baud": (1, 10**7), "bits": (5, 8), "stop_bits": (1, 2)}.items()
        if name in given
    }
    flags = {name: faults.collect(given[name].boolean) for name in ("dtr", "rts") if name in given}
    words = {"parity": faults.collect(given["parity"].choice, PARITIES)} if "parity" in given else {}
    times = {name: faults.collect(_time, given[name]) for name in ("gap", "settle") if name in given}
    settings = {**whole, **flags, **words, **times}
    known = {name: value for name, value in settings.items() if value is not None}
    return Line(**known) if "baud" in known else None  # type: ignore[arg-type]


def _between(node: YamlNode, low: int, high: int) -> int:
    value = whole_number(node)
    if not low <= value <= high:
        raise node.wrong(f"a whole number from {low} to {high}")
    return value


def _time(node: YamlNode) -> float:
    value = node.quantity(SECOND, bare=False)
    if not 0.0 <= value <= LONGEST_SETTLE:
        raise node.wrong(f"a time from 0 s to {LONGEST_SETTLE:g} s")
    return value
