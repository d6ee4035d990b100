"""Samples as datagrams for PlotJuggler's plugin "UDP Server", in JSON or MessagePack.

The plugin makes a curve of every number of an object, of an array one for each element, and takes the time
of the samples from the key `timestamp` (s), if this is ticked there. A key is the path of a block and the
name of a field, as in a log. The plugin stops at a text that is no JSON, so a number that is not finite is
null, of which it makes nothing; and one version of it reads 2048 bytes of a datagram, no more.
(github.com/facontidavide/PlotJuggler: DataStreamUDP/udp_server.cpp, and nlohmann_parsers.cpp.)
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from quadvis.bridge.blocks import BlockSamples
from quadvis.output.log import field_names
from quadvis.output.stretch import NANOSECONDS
from quadvis.wire.messages import pack

TIMESTAMP = "timestamp"
MOST = 1400  # bytes of a datagram: it travels in one piece over Ethernet

Encode = Callable[[Mapping[str, Any]], bytes]


def as_json(fields: Mapping[str, Any]) -> bytes:
    """Return fields as JSON."""
    return json.dumps(fields, separators=(",", ":"), allow_nan=False).encode()


ENCODINGS: Mapping[str, Encode] = {"json": as_json, "messagepack": pack}


def datagrams(samples: BlockSamples, encode: Encode, most: int = MOST) -> Iterator[bytes]:
    """Yield samples as datagrams of at most so many bytes, at least one for each time."""
    fields = [field for block in samples.blocks for field in _fields(block.path, block.ports)]
    for stamp, row in zip((samples.stamps / NANOSECONDS).tolist(), samples.values, strict=True):
        yield from _packed(stamp, dict(_entries(fields, row)), encode, most)


def _fields(path: str, ports: Any) -> Iterator[tuple[str, int | None, bool]]:
    """Yield the key of each port, the length of its array (None: a number), and whether it is whole."""
    for port, name in zip(ports, field_names(ports), strict=True):
        yield f"{path.strip('/')}/{name}", port.size if port.shape else None, port.type != "float64"


def _entries(fields: Any, row: Any) -> Iterator[tuple[str, Any]]:
    first = 0
    for key, size, whole in fields:
        part = row[first : first + (size or 1)]
        first += size or 1
        values = [(int(x) if whole else x) if math.isfinite(x) else None for x in part.tolist()]
        yield key, values[0] if size is None else values


def _packed(stamp: float, entries: dict[str, Any], encode: Encode, most: int) -> Iterator[bytes]:
    """Yield entries in as many datagrams as they need: halved, and arrays taken apart, until they fit."""
    data = encode({TIMESTAMP: stamp, **entries})
    if len(data) <= most:
        yield data
        return
    if len(entries) > 1:
        halves = list(entries.items())
        middle = len(halves) // 2
        for half in (halves[:middle], halves[middle:]):
            yield from _packed(stamp, dict(half), encode, most)
        return
    ((key, value),) = entries.items()
    if isinstance(value, list):
        elements = {f"{key}[{number}]": each for number, each in enumerate(value)}
        yield from _packed(stamp, elements, encode, most)
    else:
        yield data  # a name that is longer than a datagram
