"""Chunks of an MCAP file: the head of a chunk, and its contents unpacked, up to a bound."""

from __future__ import annotations

import struct
from importlib import import_module
from typing import Any

CHUNK_HEAD = struct.Struct("<QQQII")  # first and last time, size unpacked, its CRC, length of the packing


def packing_of(body: memoryview) -> str | None:
    """Return the packing of a chunk, "" if it is not packed; None if the packing is unknown."""
    length = CHUNK_HEAD.unpack_from(body)[4]
    name = bytes(body[CHUNK_HEAD.size : CHUNK_HEAD.size + min(length, 8)])
    return name.decode() if name in (b"", b"lz4", b"zstd") and len(name) == length else None


def unpacked(packing: str, packed: memoryview, size: int) -> bytes | None:
    """Return the unpacked chunk, at most one byte more than `size`; None if it is damaged."""
    try:
        return (_unpack_lz4 if packing == "lz4" else _unpack_zstd)(bytes(packed), size + 1)
    except (ImportError, RuntimeError, EOFError, ValueError, MemoryError):
        return None


def _unpack_lz4(packed: bytes, most: int) -> bytes:
    frame: Any = import_module("lz4.frame")
    return bytes(frame.LZ4FrameDecompressor().decompress(packed, max_length=most))


def _unpack_zstd(packed: bytes, most: int) -> bytes:
    import zstandard

    # The window that the format recommends for every decoder, or that a frame of this size may need.
    window = min(max(8 << 20, 1 << most.bit_length()), 1 << 31)
    parts = []
    try:
        with zstandard.ZstdDecompressor(max_window_size=window).stream_reader(packed) as reader:
            while most > 0 and (part := reader.read(min(most, 1 << 20))):
                parts.append(part)
                most -= len(part)
    except zstandard.ZstdError as error:
        raise ValueError(str(error)) from error
    return b"".join(parts)
