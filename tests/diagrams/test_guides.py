"""The guides: their files are written, and their commands run in their order, as a reader would."""

from __future__ import annotations

import re
import shlex
import shutil
from pathlib import Path
from typing import NamedTuple

import pytest

from quadvis.cli import main
from quadvis.cli.options import parser

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


def shown(guide: Path) -> list[Shown]:
    return [Shown(*match) for match in FENCE.findall(guide.read_text(encoding="utf-8"))]


def test_a_guide_shows_files_with_names_and_commands_of_ours_alone() -> None:
    assert len(GUIDES) >= 11
    for guide in GUIDES:
        for each in shown(guide):
            assert each.language in {"sh", "yaml", "python"}, guide
            assert each.language == "sh" or each.words.endswith((".yaml", ".py")), guide
            assert each.language != "sh" or all(
                line.startswith("quadvis ") for line in each.text.splitlines()
            )


@pytest.mark.parametrize("guide", GUIDES, ids=lambda guide: guide.stem)
def test_the_commands_of_a_guide_can_be_read(guide: Path) -> None:
    assert all(parser().parse_args(words).command for each in shown(guide) for words, _ in each.commands)


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
    for each in shown(guide):
        if each.language != "sh":
            path = tmp_path / each.words
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(each.text, encoding="utf-8")
        for words, code in each.commands:
            # How late a loop is depends on the machine: one with overruns still shows what the guide says.
            codes = {code, 1} if "--real-time" in words else {code}
            assert main(words) in codes, (words, capsys.readouterr())
