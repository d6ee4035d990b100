"""A diagram as a PDF, read back from its bytes: pages, links, texts and their sizes."""

from __future__ import annotations

import re
import zlib
from pathlib import Path

import pytest

import quadvis
from quadvis.cli import main
from quadvis.diagram.book import draw_book
from quadvis.diagram.picture import picture_of
from quadvis.output.draw import draw
from quadvis.output.drawn import DrawnBlock, DrawnWire
from quadvis.output.folding import parts_of
from quadvis.output.sheets import LEAST, Leaf, bound

ROOT = Path(__file__).parents[2]
PART = """quadvis: 1
name: part
ports: {in: [u], out: {y: fast.y}}
blocks:
  slow: {block: signal.low_pass, with: {time_constant: 50 ms}, in: {u: in.u}}
  fast: {block: signal.gain, with: {factor: 2.5}, in: {u: slow.y}}
"""
WHOLE = """quadvis: 1
name: whole
rates: {fast: 100 Hz}
stop_time: 1 s
blocks:
  speed: {block: sources.step, rate: fast, with: {after: 20 rad/s, at: 100 ms}}
  left: {part: part.yaml, rate: fast, in: {u: speed.y}}
  right: {part: part.yaml, rate: fast, in: {u: left.y}}
"""


class Read:
    """A PDF by its objects, as ISO 32000-1 has them."""

    def __init__(self, data: bytes) -> None:
        assert data.startswith(b"%PDF-1.4") and data.endswith(b"%%EOF\n")
        start = int(re.search(rb"startxref\n(\d+)", data)[1])  # type: ignore[index]
        places = [int(line[:10]) for line in data[start:].split(b"trailer")[0].splitlines()[3:]]
        self.objects = {}
        for number, place in enumerate(places, 1):
            head = f"{number} 0 obj\n".encode()
            assert data[place:].startswith(head)  # the table leads to each object
            self.objects[number] = data[place + len(head) : data.index(b"\nendobj", place)]
        self.pages = [number for number, text in self.objects.items() if b"/Type/Page/" in text]

    def content(self, page: int) -> str:
        number = int(re.search(rb"/Contents (\d+)", self.objects[self.pages[page]])[1])  # type: ignore[index]
        return self.stream(number).decode("ascii")

    def stream(self, number: int) -> bytes:
        return zlib.decompress(self.objects[number].split(b"stream\n", 1)[1].rsplit(b"\nendstream", 1)[0])

    def links(self, page: int) -> list[int]:
        found = re.findall(rb"/Dest\[(\d+) 0 R/Fit\]", self.objects[self.pages[page]])
        return [self.pages.index(int(number)) for number in found]

    def sizes(self, page: int) -> list[float]:
        """Return the sizes of all texts of a page in points."""
        content = self.content(page)
        scale = float(re.search(r"^q ([\d.]+) 0 0 -", content, re.MULTILINE)[1])  # type: ignore[index]
        drawing, _, foot = content.rpartition("\nQ\n")
        sizes = [scale * float(size) for size in re.findall(r"/[FB] ([\d.]+) Tf", drawing)]
        return sizes + [float(size) for size in re.findall(r"/[FB] ([\d.]+) Tf", foot)]

    def letters(self) -> dict[str, dict[str, str]]:
        """Return the characters by the numbers of their glyphs, for each typeface."""
        fonts = re.search(rb"/Font<<(.*?)>>", self.objects[self.pages[0]])[1]  # type: ignore[index]
        found = {}
        for name, number in re.findall(rb"/(\w) (\d+) 0 R", fonts):
            stream = int(re.search(rb"/ToUnicode (\d+)", self.objects[int(number)])[1])  # type: ignore[index]
            pairs = re.findall(rb"<(\w{4})> <(\w+)>", self.stream(stream))
            found[name.decode()] = {
                glyph.decode(): bytes.fromhex(code.decode()).decode("utf-16-be") for glyph, code in pairs
            }
        return found

    def texts(self, page: int) -> list[str]:
        letters = self.letters()
        found = re.findall(r"/([FB]) [\d.]+ Tf [^<]*<(\w*)> Tj", self.content(page))
        return [
            "".join(letters[face][text[place : place + 4]] for place in range(0, len(text), 4))
            for face, text in found
        ]


@pytest.mark.slow
def test_the_whole_comes_first_then_each_part_with_links_both_ways(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("part.yaml").write_text(PART)
    Path("whole.yaml").write_text(WHOLE)
    assert main(["draw", "whole.yaml", "--book", "whole.pdf"]) == 0
    read = Read(Path("whole.pdf").read_bytes())
    assert len(read.pages) == 3
    assert [read.links(page) for page in range(3)] == [[1, 2], [0], [0]]
    for page, title in enumerate(("whole", "whole: left", "whole: right")):
        texts = read.texts(page)
        assert texts[0] == title and texts[-1] == f"{page + 1} / 3"
        assert {"slow", "fast", "2.5", "50 ms"} <= set(texts)
        assert min(read.sizes(page)) >= LEAST
        assert b"/MediaBox[0 0 841.89 595.28]" in read.objects[read.pages[page]]  # A4 is enough
    assert Path("whole.pdf").read_bytes() == draw_book(quadvis.load("whole.yaml"))
    assert main(["draw", "whole.yaml", "--book", "a3.pdf", "--paper", "a3"]) == 0
    assert b"/MediaBox[0 0 1190.55 841.89]" in Path("a3.pdf").read_bytes()


def test_what_no_page_can_hold_goes_on_over_several() -> None:
    blocks = [DrawnBlock(f"b{n}", "signal.gain", ("u",) if n else (), ("y",), "t") for n in range(40)]
    wires = [DrawnWire(f"b{n}.y", f"b{n + 1}", "u") for n in range(39)]
    leaf = Leaf("chain", draw("chain", blocks, wires, {}, {"t": "task"}))
    assert not leaf.fits("a3")
    read = Read(bound("chain", [leaf], "a3"))
    assert len(read.pages) > 2
    for page in range(len(read.pages)):
        assert min(read.sizes(page)) == pytest.approx(LEAST, abs=0.01)
        assert f"chain, sheet {page + 1} of {len(read.pages)}" in read.texts(page)


@pytest.mark.parametrize("option", [["--part", "p"], ["--depth", "1"], ["-o", "x.svg"]])
def test_a_book_has_no_part_of_its_own(option: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["draw", "whole.yaml", "--book", "x.pdf", *option]) == 2
    assert "leave out --" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.parametrize(("name", "variant"), [("takeover", "robust"), ("flight", None), ("hover", None)])
def test_the_largest_diagrams_are_legible_on_a3(name: str, variant: str | None) -> None:
    diagram = quadvis.load(ROOT / "diagrams" / f"{name}.yaml", variant=variant)
    read = Read(draw_book(diagram))
    parts = parts_of(picture_of(diagram)[0].blocks)
    assert len(read.pages) >= 1 + len(parts) and read.links(0)
    assert not any(" sheet 1 of " in text for text in read.texts(0))  # the whole is on one
    for page in range(len(read.pages)):
        assert min(read.sizes(page)) >= LEAST - 0.01
