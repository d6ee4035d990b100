"""Messages of an MCAP file: rows of several channels side by side in the order of time, cut into chunks."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quadvis.output.mcap_records import HEAD, MESSAGE
from quadvis.output.recording import SLOT, Slots

CDR = b"\x00\x01\x00\x00"  # plain CDR, little endian
FRONT = struct.Struct("<BQHI")  # kind, length of what follows, channel, sequence
TIMES = 16  # bytes of the two times behind the front, both the stamp of the row

Stamps = NDArray[np.int64]


@dataclass(frozen=True)
class ChannelRows:
    """Rows (N, slots) of a channel with their stamps (N,) in ns; ``channel`` is its number."""

    channel: int
    stamps: Stamps
    slots: Slots


@dataclass(frozen=True)
class MessageChunk:
    """The contents of a chunk.

    ``count`` is the number of its messages, ``first`` and ``last`` are their least and largest stamp (ns).
    ``indexes`` has the stamps and the places (M, 2) of the M messages of each channel.
    """

    data: memoryview
    count: int
    first: int
    last: int
    indexes: dict[int, NDArray[np.uint64]]


def message_size(slots: int) -> int:
    """Return the bytes of a message."""
    return FRONT.size + TIMES + len(CDR) + SLOT * slots


def message_chunks(rows: Sequence[ChannelRows], head: bytes, most: int) -> Iterator[MessageChunk]:
    """Yield all rows as messages in chunks of at most ``most`` bytes, or of one message if it is larger.

    Messages are in the order of their stamps, those with the same stamp in the order of ``rows``. A channel
    whose stamps go back keeps the order of its rows. The first chunk begins with ``head``.
    """
    stamps = np.concatenate([each.stamps for each in rows])
    sizes = np.repeat(
        [message_size(each.slots.shape[1]) for each in rows], [len(each.stamps) for each in rows]
    )
    reached = np.concatenate([np.maximum.accumulate(each.stamps) for each in rows])
    order = np.argsort(reached, kind="stable")
    ends = len(head) + np.cumsum(sizes[order])
    places = np.empty_like(ends)
    places[order] = ends - sizes[order]
    image = np.empty(ends[-1], np.uint8)
    image[: len(head)] = np.frombuffer(head, np.uint8)
    bounds = np.cumsum([len(each.stamps) for each in rows])[:-1]
    parts = list(zip(rows, np.split(places, bounds), strict=True))
    for each, own in parts:
        _write(image, own, each)
    start = done = 0
    while done < len(order):
        until = max(done + 1, int(np.searchsorted(ends, start + most, "right")))
        stop, within = int(ends[until - 1]), stamps[order[done:until]]
        indexes = {}
        for each, own in parts:
            some = slice(*np.searchsorted(own, (start, stop)))
            if some.start < some.stop:
                indexes[each.channel] = np.column_stack((each.stamps[some], own[some] - start)).astype("<u8")
        yield MessageChunk(
            image[start:stop].data, until - done, int(within.min()), int(within.max()), indexes
        )
        start, done = stop, until


def _write(image: NDArray[np.uint8], places: NDArray[np.int64], rows: ChannelRows) -> None:
    """Write the messages of a channel to their places.

    Runs of bytes have void types: numpy copies them whole, unlike numbers that are not aligned.
    """
    size = SLOT * rows.slots.shape[1]
    message = np.dtype(
        [("front", f"V{FRONT.size}"), ("time", "<i8"), ("published", "<i8"), ("cdr", f"V{len(CDR)}"),
         ("row", f"V{size}")]
    )  # fmt: skip
    found = np.empty(len(places), message)
    length = message.itemsize - HEAD.size
    found["front"] = np.void(FRONT.pack(MESSAGE, length, rows.channel, 0))
    found["time"] = found["published"] = rows.stamps
    found["cdr"] = np.void(CDR)
    found["row"] = np.ascontiguousarray(rows.slots, "<i8").view(f"V{size}")[:, 0]
    # A message may begin at any byte: the view has one at each.
    whole = f"V{message.itemsize}"
    anywhere = np.ndarray(len(image) - message.itemsize + 1, whole, image, strides=(1,))
    anywhere[places] = found.view(whole)
