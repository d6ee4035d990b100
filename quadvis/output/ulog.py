"""Logs in the format of PX4, ULog, version 1, as documented at docs.px4.io: for its many viewers.

Each block is a message with a field for each of its ports. ULog counts whole microseconds.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from quadvis.errors import QuadvisError
from quadvis.output.log import unique
from quadvis.output.recording import RecordedBlock, RecordedPort, Recording

MAGIC = b"ULog\x01\x12\x35\x01"
TYPES = {"float64": ("double", "<f8"), "int64": ("int64_t", "<i8"), "bool": ("bool", "?")}
LONGEST = (1 << 16) - 8  # bytes of one message
MICROSECOND = 1000  # ns


def ulog(recording: Recording, signals: Sequence[str], facts: Mapping[str, str]) -> bytes:
    """Return a file with these signals; ``facts`` of the run are kept as information in it.

    QuadvisError if a block has more values than a message holds.
    """
    chosen = [block for block in _chosen(recording, signals) if len(recording.arrays(block.path)[0])]
    kinds = [_kind(block) for block in chosen]
    names = _names([block.path.strip("/") for block in chosen])
    parts = [MAGIC + struct.pack("<Q", 0), _message(b"B", bytes(40))]
    parts += [_message(b"I", _information(f"char[{len(text.encode())}] {key}", text.encode()))
              for key, text in facts.items() if text]  # fmt: skip
    parts += [_message(b"F", _format(name, block)) for name, block in zip(names, chosen, strict=True)]
    for number, name in enumerate(names):
        parts.append(_message(b"A", struct.pack("<BH", 0, number) + name.encode()))
    parts += _rows(recording, chosen, kinds)
    return b"".join(parts)


def _chosen(recording: Recording, signals: Sequence[str]) -> list[RecordedBlock]:
    """Return the blocks with the ports that were chosen."""
    asked = {recording.wire(name).source for name in signals}
    found = []
    for block in recording.blocks:
        ports = tuple(port for port in block.ports if not asked or block.signal(port) in asked)
        if ports:
            found.append(block._replace(ports=ports))
    return found


def _kind(block: RecordedBlock) -> np.dtype[Any]:
    """Return how a row lies in a message: the message's number, the time, the values."""
    fields: list[Any] = [("size", "<u2"), ("type", "S1"), ("number", "<u2"), ("timestamp", "<u8")]
    fields += [(f"v{place}", TYPES[port.type][1], (port.size,)) for place, port in enumerate(block.ports)]
    kind = np.dtype(fields)
    if kind.itemsize > LONGEST:
        raise QuadvisError(f"block '{block.path.strip('/')}' has too many values for ULog; choose others")
    return kind


def _format(name: str, block: RecordedBlock) -> bytes:
    fields = ["uint64_t timestamp"]
    names = _names([port.name for port in block.ports])
    fields += [_field(field, port) for field, port in zip(names, block.ports, strict=True)]
    return f"{name}:{';'.join(fields)};".encode()


def _field(name: str, port: RecordedPort) -> str:
    kind = TYPES[port.type][0]
    return f"{kind}[{port.size}] {name}" if port.shape else f"{kind} {name}"


def _names(names: Sequence[str]) -> list[str]:
    """Return names that ULog permits, each once."""
    return unique([re.sub(r"[^a-z0-9_/-]", "_", name.lower()) for name in names], "_")


def _rows(
    recording: Recording, blocks: Sequence[RecordedBlock], kinds: Sequence[np.dtype[Any]]
) -> Iterator[bytes]:
    """Yield the rows of all blocks in the order of time."""
    stamps, texts = [], []
    for number, (block, kind) in enumerate(zip(blocks, kinds, strict=True)):
        own, rows = _packed(recording, block, kind, number)
        data = rows.tobytes()
        stamps.append(own)
        texts += [data[start : start + kind.itemsize] for start in range(0, len(data), kind.itemsize)]
    order = np.argsort(np.concatenate(stamps), kind="stable") if stamps else ()
    yield from (texts[place] for place in order)


def _packed(
    recording: Recording, block: RecordedBlock, kind: np.dtype[Any], number: int
) -> tuple[NDArray[np.int64], NDArray[Any]]:
    """Return the stamps (ns) and the messages of a block."""
    own = recording.arrays(block.path)[0]
    rows = np.zeros(len(own), kind)
    rows["size"], rows["type"], rows["number"] = kind.itemsize - 3, b"D", number
    rows["timestamp"] = own // MICROSECOND
    for place, port in enumerate(block.ports):
        rows[f"v{place}"] = recording[block.signal(port)].reshape(len(own), port.size)
    return own, rows


def _information(key: str, value: bytes) -> bytes:
    return struct.pack("<B", len(key)) + key.encode() + value


def _message(kind: bytes, body: bytes) -> bytes:
    return struct.pack("<H", len(body)) + kind + body
