"""Read the size and the end of a picture from its bytes before decoding, and check that it is whole.

PNG, JPEG, BMP, TIFF, PNM and WebP are read by their specifications. A decoder would take as much memory as a
header declares, would invent missing pixels, and would turn the picture if the file asks for it. These checks
prevent all three.
"""

from __future__ import annotations

import re
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

CUT = "is cut short; give the whole file"
DAMAGED = "is damaged, or cut short; give the whole file"
ANIMATED = "is an animation, which holds several pictures; save one of them as PNG"
CMYK = "has the colours of a printer (CMYK); save it as RGB or grey"
NAMES = "PNG, JPEG, BMP, TIFF, PGM, PPM or WebP"

# TIFF and EXIF: tags, tags for the places and lengths of strips and tiles, and types of whole numbers.
_WIDTH, _HEIGHT, _PHOTOMETRIC, _ORIENTATION = 256, 257, 262, 274
_PIECES = ((273, 279), (324, 325))
_WHOLE = {3: ("H", 2), 4: ("I", 4)}
_INKS = 5
_UPRIGHT = 1
_TURNED = {(orientation,) for orientation in range(2, 9)}

# A marker that ends the coded data of a JPEG's scan: any marker except stuffed zeros, fill bytes and
# restarts.
_SCAN_END = re.compile(rb"\xff[^\x00\xff\xd0-\xd7]")
_SOI, _EOI, _SOS, _APP1 = 0xD8, 0xD9, 0xDA, 0xE1
_FRAMES = {*range(0xC0, 0xD0)} - {0xC4, 0xC8, 0xCC}


class FormatFault(Exception):
    """A fault of a picture; the text is the end of a sentence that begins with the picture's path."""


@dataclass(frozen=True)
class PictureLayout:
    """Width and height (px) of a picture, and its bytes.

    `coded` is the picture alone, without any bytes after its end; `turned` says whether the file asks viewers
    to turn or mirror the picture.
    """

    width: int
    height: int
    coded: bytes
    turned: bool = False


def layout(data: bytes) -> PictureLayout:
    """Return the layout of the first picture in a file; FormatFault if the file holds no whole picture."""
    if not data:
        raise FormatFault(f"is not a picture: it is empty; give a {NAMES} file")
    for head, read in _READERS:
        if re.match(head, data, re.DOTALL):
            try:
                return read(data)
            except (struct.error, IndexError):  # a number lies behind the end
                raise FormatFault(CUT) from None
    raise FormatFault(f"is not a picture; give a {NAMES} file")


def _png(data: bytes) -> PictureLayout:
    width, height = struct.unpack_from(">II", data, 16)
    position, turned = 8, False
    while True:
        length, kind = struct.unpack_from(">I4s", data, position)
        end = position + 12 + length
        if end > len(data):
            raise FormatFault(CUT)
        if kind[:1].isupper():  # a critical chunk: a picture needs it
            if zlib.crc32(data[position + 4 : end - 4]) != struct.unpack_from(">I", data, end - 4)[0]:
                raise FormatFault(DAMAGED)
            if kind == b"IEND":
                return PictureLayout(width, height, data[:end], turned)
        elif kind == b"acTL":
            raise FormatFault(ANIMATED)
        elif kind == b"eXIf":
            turned = _asks_to_be_turned(data[position + 8 : end - 4])
        position = end


def _jpeg(data: bytes) -> PictureLayout:
    position, turned = 2, False
    width = height = 0
    while True:
        marker, position = _marker(data, position)
        if marker == _EOI:
            break
        if marker == _SOI:  # another picture begins inside this one
            raise FormatFault(CUT)
        (length,) = struct.unpack_from(">H", data, position)
        body = data[position + 2 : position + length]
        if marker in _FRAMES:
            _, height, width, components = struct.unpack_from(">BHHB", body)
            if components == 4:
                raise FormatFault(CMYK)
        elif marker == _APP1 and body.startswith(b"Exif\0\0"):
            turned |= _asks_to_be_turned(body[6:])
        position += length
        if marker == _SOS:
            found = _SCAN_END.search(data, position)
            if found is None:
                raise FormatFault(CUT)
            position = found.start()
    return PictureLayout(width, height, data[:position], turned)


def _marker(data: bytes, position: int) -> tuple[int, int]:
    """Return the next marker of a JPEG and the position after it."""
    if data[position] != 0xFF:
        raise FormatFault(DAMAGED)
    while data[position] == 0xFF:
        position += 1
    marker = data[position]
    if not marker:
        raise FormatFault(DAMAGED)
    return marker, position + 1


def _bmp(data: bytes) -> PictureLayout:
    size, offset, header = struct.unpack_from("<I4xII", data, 2)
    if header == 12:
        width, height, _, bits = struct.unpack_from("<HHHH", data, 18)
        compression = 0
    else:
        width, height, _, bits, compression, coded = struct.unpack_from("<iiHHII", data, 18)
    if compression in (0, 3):  # without compression; the length that the file states may be wrong
        size = offset + (width * bits + 31) // 32 * 4 * abs(height)
    elif compression in (1, 2):
        size = offset + coded
    else:
        raise FormatFault("is compressed in a way that is not read here; save it as PNG")
    if len(data) < size:
        raise FormatFault(CUT)
    return PictureLayout(width, abs(height), data[:size])


def _tiff(data: bytes) -> PictureLayout:
    found, coded = {tag.number: tag for tag in _tiff_tags(data)}, data
    values = {number: tag.values for number, tag in found.items() if tag.values}
    if values.get(_PHOTOMETRIC) == (_INKS,):
        raise FormatFault(CMYK)
    for offsets, counts in _PIECES:
        pieces = zip(values.get(offsets, ()), values.get(counts, ()), strict=False)
        if any(offset + count > len(data) for offset, count in pieces):
            raise FormatFault(CUT)
    turned = _is_turned(found.values())
    if turned:  # the decoder would turn the picture
        tag = found[_ORIENTATION]
        changed = bytearray(data)
        struct.pack_into(tag.format, changed, tag.place, _UPRIGHT)
        coded = bytes(changed)
    return PictureLayout(values.get(_WIDTH, (0,))[0], values.get(_HEIGHT, (0,))[0], coded, turned)


@dataclass(frozen=True)
class _Tag:
    """An entry of a TIFF directory that holds whole numbers, with the type and the position of the first."""

    number: int
    format: str
    place: int
    values: tuple[int, ...]


def _tiff_tags(data: bytes) -> Iterator[_Tag]:
    """Yield the whole numbers in the first directory."""
    order = "<" if data[:2] == b"II" else ">"
    (directory,) = struct.unpack_from(f"{order}I", data, 4)
    (count,) = struct.unpack_from(f"{order}H", data, directory)
    for entry in range(directory + 2, directory + 2 + 12 * count, 12):
        tag, kind, number = struct.unpack_from(f"{order}HHI", data, entry)
        if kind not in _WHOLE or number > len(data):
            continue
        letter, size = _WHOLE[kind]
        place = entry + 8
        if number * size > 4:
            (place,) = struct.unpack_from(f"{order}I", data, place)
        numbers = struct.unpack_from(f"{order}{number}{letter}", data, place)
        yield _Tag(tag, order + letter, place, numbers)


def _asks_to_be_turned(exif: bytes) -> bool:
    """Return whether an EXIF block, which is a TIFF directory, asks viewers to turn the picture."""
    try:
        return _is_turned(_tiff_tags(exif))
    except struct.error:  # a damaged block asks for nothing
        return False


def _is_turned(tags: Iterable[_Tag]) -> bool:
    return any(tag.number == _ORIENTATION and tag.values[:1] in _TURNED for tag in tags)


def _pnm(data: bytes) -> PictureLayout:
    kind, position = data[1:2], 2
    numbers: list[int] = []
    while len(numbers) < (2 if kind == b"4" else 3):
        found = re.compile(rb"(?:\s|#[^\r\n]*[\r\n])+(\d{1,9})(?=\s)").match(data, position)
        if found is None:
            raise FormatFault(DAMAGED)
        numbers.append(int(found[1]))
        position = found.end()
    width, height, *brightest = numbers
    if brightest not in ([], [255], [65535]):
        raise FormatFault(f"has {brightest[0]} for its brightest value; save it with 255 or 65535")
    row = (width + 7) // 8 if kind == b"4" else width * (3 if kind == b"6" else 1)
    end = position + 1 + row * height * (2 if brightest == [65535] else 1)
    if end > len(data):
        raise FormatFault(CUT)
    return PictureLayout(width, height, data[:end])


def _webp(data: bytes) -> PictureLayout:
    end = 8 + struct.unpack_from("<I", data, 4)[0]
    if end > len(data):
        raise FormatFault(CUT)
    kind, turned = data[12:16], False
    if kind == b"VP8 ":
        width, height = (side & 0x3FFF for side in struct.unpack_from("<HH", data, 26))
    elif kind == b"VP8L":
        (bits,) = struct.unpack_from("<I", data, 21)
        width, height = 1 + (bits & 0x3FFF), 1 + (bits >> 14 & 0x3FFF)
    else:
        if data[20] & 2:
            raise FormatFault(ANIMATED)
        width, height = (1 + int.from_bytes(data[place : place + 3], "little") for place in (24, 27))
        turned = _webp_turned(data[:end])
    return PictureLayout(width, height, data[:end], turned)


def _webp_turned(data: bytes) -> bool:
    position = 12
    while position + 8 <= len(data):
        kind, length = struct.unpack_from("<4sI", data, position)
        if kind == b"EXIF":
            return _asks_to_be_turned(data[position + 8 : position + 8 + length].removeprefix(b"Exif\0\0"))
        position += 8 + length + length % 2
    return False


def _refuse(problem: str) -> Callable[[bytes], PictureLayout]:
    def read(data: bytes) -> PictureLayout:
        raise FormatFault(problem)

    return read


_READERS: tuple[tuple[bytes, Callable[[bytes], PictureLayout]], ...] = (
    (rb"\x89PNG\r\n\x1a\n", _png),
    (rb"\xff\xd8\xff", _jpeg),
    (rb"BM.{12}[\x0c\x28\x34\x38\x40\x6c\x7c]\0\0\0", _bmp),
    (rb"II\*\0|MM\0\*", _tiff),
    (rb"P[456]\s", _pnm),
    (rb"RIFF.{4}WEBPVP8[ LX]", _webp),
    (rb"II\+\0|MM\0\+", _refuse("is a BigTIFF; save it as PNG or as a plain TIFF")),
    (rb"GIF8", _refuse("is a GIF, which has few colours and may be an animation; save it as PNG")),
    (rb"P[123]\s", _refuse("is a picture in the form of text; save it as PNG")),
    (rb"\x89P|\xff\xd8|II\*|MM\0", _refuse(DAMAGED)),
)
