"""The guides: their files are written, and their commands run in their order, as a reader would.

What a guide shows of what its commands print stands in a fence ``text`` behind theirs. It must be what they
print: "..." stands for any characters of a line, or on a line of its own for any lines.
"""

from __future__ import annotations

import itertools
import re
import shlex
import shutil
from pathlib import Path
from typing import NamedTuple

import pytest

from quadvis.cli import main
from quadvis.cli.options import parser
from quadvis.library.catalogue import Catalogue

ROOT = Path(__file__).parents[2]
GUIDES = sorted((ROOT / "diagrams" / "guides").glob("*.md"))
FENCE = re.compile(r"^```(\w+) ?(.*?)\n(.*?)^```$", re.MULTILINE | re.DOTALL)


class Shown(NamedTuple):
    """A fenced text of a guide: its language, the words after that, and the text."""

    language: str
    words: str
    text: str

    @property
    def commands(self) -> list[tuple[list[str], int]]:
        """The arguments of its commands, and the exit codes that they shall have."""
        if self.language != "sh":
            return []
        lines = [line.partition(" # ") for line in self.text.splitlines()]
        return [(shlex.split(line)[1:], 1 if "FAILED" in comment else 0) for line, _, comment in lines]

    def is_like(self, printed: str) -> bool:
        """Return whether this text shows what was printed."""
        lines = [
            r"(?:.*\n)*?" if line.strip() == "..." else re.escape(line).replace(r"\.\.\.", ".*") + r" *\n"
            for line in self.text.splitlines()
        ]
        return re.fullmatch("".join(lines), printed) is not None


def shown(guide: Path) -> list[Shown]:
    return [Shown(*match) for match in FENCE.findall(guide.read_text(encoding="utf-8"))]


def test_a_guide_shows_files_with_names_and_commands_of_ours_alone() -> None:
    assert len(GUIDES) >= 11
    for guide in GUIDES:
        for each in shown(guide):
            assert each.language in {"sh", "text", "yaml", "python"}, guide
            assert each.language in {"sh", "text"} or each.words.endswith((".yaml", ".py")), guide
            assert each.language != "sh" or all(
                line.startswith("quadvis ") for line in each.text.splitlines()
            )


@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: guide.stem)
def test_the_commands_of_a_guide_can_be_read(guide: Path) -> None:
    assert all(parser().parse_args(words).command for each in shown(guide) for words, _ in each.commands)


def test_every_guide_shows_what_its_commands_print() -> None:
    for guide in GUIDES:
        languages = [each.language for each in shown(guide)]
        assert "text" in languages, guide
        behind = [first for first, second in itertools.pairwise(languages) if second == "text"]
        assert {*behind} == {"sh"}, guide


def test_every_block_that_a_guide_names_is_there() -> None:
    names = {*Catalogue().names()}
    groups = {name.partition(".")[0] for name in names}
    found = {
        word for guide in GUIDES for word in re.findall(r"`([a-z]+\.[a-z0-9_]+)`", guide.read_text("utf-8"))
    }
    named = {word for word in found if word.partition(".")[0] in groups}
    assert len(named) > 40
    assert named <= names


def test_an_output_that_is_out_of_date_is_found() -> None:
    text = Shown("text", "", "a: 1 (x)\n...\nwall ... s\n")
    assert text.is_like("a: 1 (x)\nwall 3 s\n")
    assert text.is_like("a: 1 (x)\nmore\n\nmore\nwall 0.2 s\n")
    assert not text.is_like("a: 2 (x)\nwall 3 s\n")
    assert not text.is_like("a: 1 (x)\nwall 3 s\nmore\n")


@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: guide.stem)
def test_every_link_of_a_guide_leads_somewhere(guide: Path) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)\)", guide.read_text(encoding="utf-8"))
    assert [each for each in targets if "://" not in each and not (guide.parent / each).exists()] == []


@pytest.mark.slow
@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: guide.stem)
def test_a_guide_can_be_followed(
    guide: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(ROOT / "diagrams", tmp_path / "diagrams")
    monkeypatch.chdir(tmp_path)
    printed = ""
    for each in shown(guide):
        if each.language == "text":
            assert each.is_like(printed), (
                f"{guide.name} shows\n{each.text}\nbut its commands print\n{printed}"
            )
        elif each.language != "sh":
            path = tmp_path / each.words
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(each.text, encoding="utf-8")
        printed = "" if each.commands else printed
        for words, code in each.commands:
            # How late a loop is depends on the machine: one with overruns still shows what the guide says.
            codes = {code, 1} if "--real-time" in words else {code}
            ended = main(words)
            found = capsys.readouterr()
            assert ended in codes, (words, found)
            printed += found.out
