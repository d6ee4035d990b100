"""Pictures of diagrams with faults: all that is known is drawn, and what is wrong is marked."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest

from quadvis.cli import main
from quadvis.diagram.load import draw_with_faults
from quadvis.errors import QuadvisError
from quadvis.output.drawn import FAULT
from tests.quadvis.corpus import all_cases
from tests.quadvis.test_draw import SVG, outline_of

HEAD = """quadvis: 1
name: faulty
rates: {fast: 100 Hz, slow: 10 Hz}
stop_time: 1 s
blocks:
  speed: {block: sources.step, rate: fast, with: {after: 20 rad/s, at: 100 ms}}
  shown: {block: signal.low_pass, rate: fast, with: {time_constant: 50 ms}, in: {u: speed.y}}
"""


def drawn(
    text: str, capsys: pytest.CaptureFixture[str], *options: str
) -> tuple[ElementTree.Element, list[str]]:
    """The picture of a diagram with these blocks, and the faults that are printed."""
    Path("faulty.yaml").write_text(HEAD + text)
    assert main(["draw", "faulty.yaml", *options]) == 2
    faults = capsys.readouterr().err.splitlines()
    return ElementTree.parse("faulty.svg").getroot(), faults


@pytest.fixture(autouse=True)
def _here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


def group(root: ElementTree.Element, role: str, **data: str) -> ElementTree.Element:
    return next(
        each
        for each in root.iter(f"{SVG}g")
        if each.get("class") == role and all(each.get(f"data-{key}") == value for key, value in data.items())
    )


@pytest.mark.parametrize(
    ("block", "port", "words"),
    [
        ("{block: signal.gain, rate: fast, in: {u: sped.y}}", "u", "there is no block 'sped'"),
        ("{block: signal.gain, rate: fast, in: {u: speed.z}}", "u", "block 'speed' has no output 'z'"),
        ("{block: signal.gain, rate: slow, in: {u: speed.y}}", "u", "how it crosses between rates"),
        ("{block: signal.gain, rate: fast}", "u", "input 'u' is not connected"),
        ("{block: signal.gain, rate: fast, in: {v: speed.y, u: 1}}", "v", "has no input 'v'"),
        ("{block: signal.gian, rate: fast, in: {u: speed.y}}", "", "there is no block 'signal.gian'"),
        ("{block: signal.gain, in: {u: speed.y}}", "", "key 'rate' is missing"),
        (
            "{block: signal.delay, rate: fast, with: {steps: 0}, in: {u: speed.y}}",
            "",
            "steps must be at least 1",
        ),
        ("{block: signal.sum, rate: fast, in: {u: [speed.y, 3 m]}}", "u[1]", "m"),
    ],
)
def test_the_faulty_port_or_block_is_marked_with_its_sentence(
    block: str, port: str, words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    root, faults = drawn(f"  x: {block}\n", capsys)
    assert len(faults) == 1 and words in faults[0]
    found = group(root, "block", path="x")
    spots = [each for each in found if each.get("class") == "fault"]
    title = found.find(f"{SVG}title")
    outline = next(each for each in found if each.get("class") == "outline")
    assert title is not None and len(spots) == bool(port)
    marked = spots[0].find(f"{SVG}title") if port else title
    assert marked is not None and words in (marked.text or "")
    assert (outline.get("stroke") == FAULT) == (not port)
    if port:  # the spot lies on the outline's left side
        circle, area = spots[0].find(f"{SVG}circle"), outline_of(found)
        assert circle is not None
        assert area.left - 0.2 <= float(circle.attrib["cx"]) < (area.left + area.right) / 2
        assert area.top < float(circle.attrib["cy"]) < area.bottom
    below = "".join(text.text or "" for text in root.findall(f"{SVG}text"))
    assert words.replace(" ", "") in below.replace(" ", "")


def test_what_is_right_is_drawn_as_ever(capsys: pytest.CaptureFixture[str]) -> None:
    root, _ = drawn("  x: {block: signal.gain, rate: slow, in: {u: speed.y}}\n", capsys)
    right = group(root, "wire", source="speed.y", target="shown.u").find(f"{SVG}polyline")
    wrong = group(root, "wire", source="speed.y", target="x.u").find(f"{SVG}polyline")
    assert right is not None and wrong is not None
    assert (right.get("stroke") == FAULT, wrong.get("stroke") == FAULT) == (False, True)
    assert "50 ms" in [text.text for text in group(root, "block", path="shown").iter(f"{SVG}text")]


def test_every_input_of_an_algebraic_loop_is_marked(capsys: pytest.CaptureFixture[str]) -> None:
    loop = "  a: {block: signal.sum, rate: fast, in: {u: [speed.y, b.y]}}\n"
    root, _ = drawn(loop + "  b: {block: signal.gain, rate: fast, in: {u: a.y}}\n", capsys)
    for path in "ab":
        assert [each.get("class") for each in group(root, "block", path=path)].count("fault") == 1


@pytest.mark.slow
def test_whatever_is_wrong_a_picture_is_drawn_or_the_faults_are_raised(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("quadvis.output.draw.MOST_BLOCKS", -1)  # the quick layout
    pictures = 0
    for number, case in enumerate(all_cases()):
        file = case.write(Path(str(number)))
        try:
            picture, error = draw_with_faults(file, own_blocks=False)
        except QuadvisError:
            continue
        root = ElementTree.fromstring(picture)
        boxes = [each for each in root.iter(f"{SVG}g") if each.get("class") == "block"]
        assert error.faults and boxes, case.title
        pictures += 1
    assert pictures > 100


def test_a_faulty_part_is_marked_and_can_be_drawn(capsys: pytest.CaptureFixture[str]) -> None:
    Path("part.yaml").write_text(
        "quadvis: 1\nname: part\nports: {in: [u], out: {y: twice.y}}\n"
        "blocks:\n  twice: {block: signal.gain, in: {u: in.u}}\n"
        "  lost: {block: signal.gain, in: {u: nobody.y}}\n"
    )
    block = "  p: {part: part.yaml, rate: fast, in: {u: speed.y}}\n"
    root, faults = drawn(block, capsys, "--depth", "1", "-o", "faulty.svg")
    assert "nobody" in faults[0]
    outline = next(each for each in group(root, "block", path="p") if each.get("class") == "outline")
    assert outline.get("stroke") == FAULT
    root, _ = drawn(block, capsys, "--part", "p", "-o", "faulty.svg")
    assert any(each.get("class") == "fault" for each in group(root, "block", path="lost"))


def test_a_file_that_cannot_be_read_gives_its_faults_and_no_picture(
    capsys: pytest.CaptureFixture[str],
) -> None:
    Path("faulty.yaml").write_text("quadvis: 1\nblocks: [")
    assert main(["draw", "faulty.yaml"]) == 2
    assert capsys.readouterr().err.startswith("faulty.yaml:") and not Path("faulty.svg").exists()
