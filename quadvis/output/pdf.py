"""Write PDF: pages with vector graphics, embedded typefaces, links between pages, and bookmarks.

PDF 1.4 after ISO 32000-1. It is written by ourselves, since links between pages are what matplotlib's own
PDF lacks, and since a library for it would be one more for everybody to install.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path

Rectangle = tuple[float, float, float, float]  # left, bottom, right, top in points, from the lower left


@dataclass
class Page:
    """A page: ``operators`` draw it, `links` lead from rectangles to the pages of these numbers."""

    title: str
    width: float  # points
    height: float
    operators: list[str] = field(default_factory=list)
    links: list[tuple[Rectangle, int]] = field(default_factory=list)
    level: int = 0  # of its bookmark


class Typeface:
    """The characters of a TrueType font that are used, embedded under a short name."""

    def __init__(self, name: str, path: Path, characters: str) -> None:
        from fontTools import subset
        from fontTools.ttLib import TTFont

        options = subset.Options(recalc_timestamp=False, layout_features=[], name_IDs=[6])
        options.drop_tables += ["FFTM"]  # times of its making, which no subset can have
        font = TTFont(path, recalcTimestamp=False)
        cut = subset.Subsetter(options)
        cut.populate(text=characters)
        cut.subset(font)
        file = BytesIO()
        font.save(file)
        self.name, self.data = name, file.getvalue()
        self._scale = 1000.0 / font["head"].unitsPerEm
        order, metrics = font.getReverseGlyphMap(), font["hmtx"]
        self._glyphs: dict[int, int] = {code: order[glyph] for code, glyph in font.getBestCmap().items()}
        names = font.getGlyphOrder()
        self._widths: list[float] = [metrics[glyph][0] * self._scale for glyph in names]
        head = font["head"]
        edges = head.xMin, head.yMin, head.xMax, head.yMax
        self._box = [round(edge * self._scale) for edge in edges]

    def hexadecimal(self, text: str) -> str:
        """Return a text as the numbers of its glyphs."""
        return "".join(f"{self._glyphs.get(ord(letter), 0):04X}" for letter in text)

    def width(self, text: str, size: float) -> float:
        """Return the width of a text in the unit of its size."""
        return sum(self._widths[self._glyphs.get(ord(letter), 0)] for letter in text) * size / 1000.0

    def write(self, file: _File) -> int:
        """Write the font; return the number of its object."""
        data = file.stream(self.data, f"/Length1 {len(self.data)}")
        box = " ".join(map(str, self._box))
        name = f"QUADVI+{self.name}"
        descriptor = file.add(
            f"<</Type/FontDescriptor/FontName/{name}/Flags 32/FontBBox[{box}]/ItalicAngle 0"
            f"/Ascent {self._box[3]}/Descent {self._box[1]}/CapHeight 729/StemV 80/FontFile2 {data} 0 R>>"
        )
        widths = " ".join(f"{width:.0f}" for width in self._widths)
        glyphs = file.add(
            f"<</Type/Font/Subtype/CIDFontType2/BaseFont/{name}/CIDSystemInfo<</Registry(Adobe)"
            f"/Ordering(Identity)/Supplement 0>>/FontDescriptor {descriptor} 0 R/CIDToGIDMap/Identity"
            f"/W[0[{widths}]]>>"
        )
        letters = file.stream(self._letters().encode("ascii"))
        return file.add(
            f"<</Type/Font/Subtype/Type0/BaseFont/{name}/Encoding/Identity-H"
            f"/DescendantFonts[{glyphs} 0 R]/ToUnicode {letters} 0 R>>"
        )

    def _letters(self) -> str:
        """Return the map from glyphs to characters, by which a text can be searched and copied."""
        pairs = sorted((glyph, code) for code, glyph in self._glyphs.items())
        lines = []
        for start in range(0, len(pairs), 100):  # the most that one section may have
            some = pairs[start : start + 100]
            lines.append(f"{len(some)} beginbfchar")
            lines += [
                f"<{glyph:04X}> <{chr(code).encode('utf-16-be').hex().upper()}>" for glyph, code in some
            ]
            lines.append("endbfchar")
        return "\n".join((
            "/CIDInit /ProcSet findresource begin 12 dict begin begincmap",
            "/CMapName /Letters def /CMapType 2 def",
            "1 begincodespacerange <0000> <FFFF> endcodespacerange",
            *lines, "endcmap CMapName currentdict /CMap defineresource pop end end",
        ))  # fmt: skip


class _File:
    """The objects of a file, numbered from 1."""

    def __init__(self) -> None:
        self.objects: list[bytes] = []

    def add(self, content: str | bytes) -> int:
        self.objects.append(content.encode("latin-1") if isinstance(content, str) else content)
        return len(self.objects)

    def stream(self, data: bytes, more: str = "") -> int:
        packed = zlib.compress(data, 9)
        head = f"<</Length {len(packed)}/Filter/FlateDecode{more}>>\nstream\n"
        return self.add(head.encode("ascii") + packed + b"\nendstream")

    def whole(self, root: int, info: int) -> bytes:
        file = bytearray(b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n")
        places = []
        for number, content in enumerate(self.objects, 1):
            places.append(len(file))
            file += f"{number} 0 obj\n".encode() + content + b"\nendobj\n"
        table = len(file)
        count = len(places) + 1
        file += f"xref\n0 {count}\n0000000000 65535 f \n".encode()
        file += b"".join(f"{place:010d} 00000 n \n".encode() for place in places)
        file += f"trailer\n<</Size {count}/Root {root} 0 R/Info {info} 0 R>>\n".encode()
        file += f"startxref\n{table}\n%%EOF\n".encode()
        return bytes(file)


def pdf(title: str, pages: Sequence[Page], typefaces: Mapping[str, Typeface]) -> bytes:
    """Return a PDF of some pages, one at least; equal pages give equal bytes.

    ``typefaces`` have the names by which operators call them.
    """
    file = _File()
    fonts = "".join(f"/{name} {face.write(file)} 0 R" for name, face in typefaces.items())
    contents = [file.stream("\n".join(page.operators).encode("ascii")) for page in pages]
    first = len(file.objects) + 1
    tree = first + len(pages)
    for page, content in zip(pages, contents, strict=True):
        links = "".join(
            f"<</Type/Annot/Subtype/Link/Rect[{' '.join(f'{edge:.2f}' for edge in area)}]/Border[0 0 0]"
            f"/Dest[{first + target} 0 R/Fit]>>"
            for area, target in page.links
        )
        file.add(
            f"<</Type/Page/Parent {tree} 0 R/MediaBox[0 0 {page.width:.2f} {page.height:.2f}]"
            f"/Resources<</Font<<{fonts}>>>>/Contents {content} 0 R/Annots[{links}]>>"
        )
    kids = " ".join(f"{first + number} 0 R" for number in range(len(pages)))
    file.add(f"<</Type/Pages/Kids[{kids}]/Count {len(pages)}>>")
    outline = _bookmarks(file, pages, first)
    root = file.add(f"<</Type/Catalog/Pages {tree} 0 R/Outlines {outline} 0 R/PageMode/UseOutlines>>")
    return file.whole(root, file.add(f"<</Title {_text(title)}/Producer(quadvis)>>"))


def _bookmarks(file: _File, pages: Sequence[Page], first: int) -> int:
    """Write a bookmark for each page; return the number of their root."""
    root = len(file.objects) + 1
    last = root + len(pages)
    file.add(f"<</Type/Outlines/First {root + 1} 0 R/Last {last} 0 R/Count {len(pages)}>>")
    for number, page in enumerate(pages):
        own = root + 1 + number
        before = f"/Prev {own - 1} 0 R" if number else ""
        after = f"/Next {own + 1} 0 R" if own < last else ""
        text = _text("    " * page.level + page.title)
        file.add(f"<</Title {text}/Parent {root} 0 R{before}{after}/Dest[{first + number} 0 R/Fit]>>")
    return root


def _text(text: str) -> str:
    return f"<FEFF{text.encode('utf-16-be', 'replace').hex().upper()}>"


def number(value: float) -> str:
    """Return a number as an operator takes it."""
    return f"{value:.2f}".rstrip("0").rstrip(".") or "0"


def colour(name: str) -> str:
    """Return "#dcecf8" as three numbers from 0 to 1."""
    return " ".join(number(int(name[place : place + 2], 16) / 255) for place in (1, 3, 5))
