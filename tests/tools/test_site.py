"""tools/site: pages made of what the code says, and no link that leads nowhere."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from quadvis.errors import QuadvisError
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import declarations, only_checked

from .script import run_script

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tools"))

from documentation.block_pictures import pictures  # noqa: E402
from documentation.build import build_site  # noqa: E402
from documentation.diagram_pages import diagram_files  # noqa: E402
from documentation.generator import render  # noqa: E402
from documentation.link_check import broken_links  # noqa: E402
from documentation.markdown import escaped, from_docstring, table  # noqa: E402
from documentation.site_map import page_of, relinked  # noqa: E402

BLOCKS = ("signal.derivative", "control.mixer", "hardware.sbus_out", "fmi.fmu")


@pytest.mark.slow
def test_two_blocks_have_their_pages_and_no_link_is_broken(tmp_path: Path) -> None:
    assert build_site(tmp_path / "site", tmp_path / "cache", names=BLOCKS) == []
    for name in BLOCKS:
        block = Catalogue().find(name)
        page = (tmp_path / "site" / "blocks" / f"{name.replace('.', '/')}.html").read_text("utf-8")
        declared = [row[0] for rows in declarations(block).values() for row in rows]
        assert declared
        assert [each for each in declared if f">{each}<" not in page] == []
        assert ("-response.svg" in page) == (only_checked(block) == "")
        assert ("-diagram.svg" in page) == (block.example_needs == "")


def test_what_an_example_writes_is_no_picture(tmp_path: Path) -> None:
    found = pictures("vision.frame_writer", Catalogue().find("vision.frame_writer"), tmp_path)
    assert [*found] == ["diagram.svg"]  # a frame is not drawn over time


@pytest.mark.slow
def test_what_did_not_change_is_not_made_again(tmp_path: Path) -> None:
    build_site(tmp_path / "site", tmp_path / "cache", names=BLOCKS[:1])
    kept = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache" / "pictures").rglob("*.svg")}
    assert len(kept) == 2
    pages = {path: path.stat().st_mtime_ns for path in (tmp_path / "cache" / "pages").rglob("*.md")}
    build_site(tmp_path / "site", tmp_path / "cache", names=BLOCKS[:1])
    assert all(path.stat().st_mtime_ns == time for path, time in (kept | pages).items())


def test_a_link_that_leads_nowhere_is_found(tmp_path: Path) -> None:
    (tmp_path / "b.html").write_text('<p id="here">', "utf-8")
    links = (
        "b.html",
        "b.html#here",
        "#top",
        "https://example.org/x",
        "mailto:a@b",
        "b.html#there",
        "c.html",
        "#no",
    )
    text = "".join(f'<a href="{link}">' for link in links)
    (tmp_path / "a.html").write_text(f'<h1 id="top">{text}<img src="no.png">', "utf-8")
    assert broken_links(tmp_path) == [
        "a.html: the link 'b.html#there' leads to no place in b.html",
        "a.html: the link 'c.html' leads to no file",
        "a.html: the link '#no' leads to no place in a.html",
        "a.html: the link 'no.png' leads to no file",
    ]


def test_a_page_with_a_fault_is_refused(tmp_path: Path) -> None:
    pages = tmp_path / "pages"
    pages.mkdir()
    (pages / "index.md").write_text("# A\n\n[b](nowhere.md)\n", "utf-8")
    with pytest.raises(QuadvisError, match=r"index\.md.*nowhere"):
        render(pages, tmp_path / "site", tmp_path / "cache")


def test_docstrings_become_markdown() -> None:
    text = "Rate: ``x_t``, |u| <= M * T.\n\nThe law is::\n\n    a = b_1 * c\n\nUp to [0, 1]."
    assert from_docstring(text) == (
        "Rate: ``x_t``, \\|u\\| \\<= M \\* T.\n\n"
        "The law is:\n\n```text\na = b_1 * c\n```\n\nUp to \\[0, 1\\]."
    )
    assert from_docstring("A:\n\n=== =====\na   b\n=== =====\n1   x\n    and y\n2   z\n=== =====\n\nB.") == (
        "A:\n\n| a | b |\n| --- | --- |\n| 1 | x and y |\n| 2 | z |\n\nB."
    )
    assert escaped("`a_b` a_b") == "`a_b` a\\_b"
    assert table(("a", "b", "c"), [("x", "", "1 | 2")]) == "| a | c |\n| --- | --- |\n| x | 1 \\| 2 |"


@pytest.mark.parametrize(
    ("path", "page"),
    [
        ("README.md", "index.md"), ("blocks/README.md", "blocks/index.md"), ("diagrams", "diagrams/index.md"),
        ("blocks/quadvis_blocks/signal", "blocks/signal/index.md"),
        ("diagrams/motor.yaml", "diagrams/motor.md"),
        ("diagrams/calib/camera.yaml", "diagrams/calib/camera.yaml"), ("LICENSE", "LICENSE"),
        ("diagrams/sets", "diagrams/index.md"),
    ],
)  # fmt: skip
def test_a_file_has_its_page(path: str, page: str) -> None:
    assert page_of(path) == page


def test_links_of_a_readme_are_led_to_pages_and_code_stays() -> None:
    text = "[a](motor.yaml) [b](../blocks/README.md#devices) [c](https://x.org)\n```\n[d](motor.yaml)\n```\n"
    moved, files = relinked(text, "diagrams/README.md")
    assert (
        moved
        == "[a](motor.md) [b](../blocks/index.md#devices) [c](https://x.org)\n```\n[d](motor.yaml)\n```\n"
    )
    assert files == {"diagrams/motor.yaml", "blocks/README.md"}


# Two thirds of the time go into the pictures: here a few are made, beside every page and every link.
DRAWN = ("signal.derivative", "logic.edge", "diagrams/step.yaml")


@pytest.mark.slow
def test_all_pages_with_a_few_of_their_pictures_have_no_broken_link(tmp_path: Path) -> None:
    assert build_site(tmp_path / "site", tmp_path / "cache", drawn=DRAWN) == []
    pages = {
        path.relative_to(tmp_path / "site").as_posix(): path for path in tmp_path.rglob("site/**/*.html")
    }
    blocks = {f"blocks/{name.replace('.', '/')}.html": name for name in Catalogue().names()}
    diagrams = {page_of(file).replace(".md", ".html"): file for file in diagram_files()}
    assert pages.keys() >= blocks.keys() | diagrams.keys()
    for page, name in (blocks | diagrams).items():
        assert ('.svg"' in pages[page].read_text("utf-8")) == (name in DRAWN), page


@pytest.mark.long
def test_the_whole_site_has_no_broken_link() -> None:
    found = run_script(ROOT / "tools" / "site", "--check")
    assert (found.returncode, found.stdout, found.stderr) == (0, "no broken link\n", "")
