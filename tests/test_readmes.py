"""The READMEs name all existing commands, options, keys and tools, and no others."""

from __future__ import annotations

import argparse
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest

from quadvis.api import load
from quadvis.cli import main
from quadvis.cli.options import parser
from quadvis.diagram.keys import SECTIONS, keys
from quadvis.diagram.schema import diagram_schema
from quadvis.diagram.sections.context import RunSection
from quadvis.diagram.sections.section import DIAGRAM, GROUP, PART, FileSection
from quadvis.machine.shipped import named_file
from tests.diagrams.golden import cases, with_programs

ROOT = Path(__file__).parents[1]
ROOMS = ("README.md", "quadvis/README.md", "blocks/README.md", "diagrams/README.md")
TEXTS = {name: (ROOT / name).read_text(encoding="utf-8") for name in ROOMS}
FAILS = "FAILED"  # how a row says that a command ends so, on purpose
COMMANDS: dict[str, argparse.ArgumentParser] = next(
    dict(action.choices)
    for action in parser()._actions
    if isinstance(action, argparse._SubParsersAction)  # argparse has no public way to ask for commands
)


@dataclass(frozen=True)
class Command:
    """A command line of a README, and the line in which it stands."""

    words: tuple[str, ...]
    line: str

    def __str__(self) -> str:
        return shlex.join(self.words)

    @property
    def options(self) -> argparse.Namespace:
        """What the command line asks for; SystemExit if it cannot be read."""
        return parser().parse_args(self.words)


def stated_commands(text: str) -> list[Command]:
    """Return the command lines of a README that can be typed as they stand.

    In tables "`... --variant x`" stands for the command beside the diagram above with these words added, and
    "`x`, `y`" for two such variants.
    """
    found: list[Command] = []
    last: tuple[str, ...] = ()
    code = False
    for line in text.splitlines():
        code = code != line.startswith("```")
        spans = [line] if code else re.findall(r"`([^`]+)`", line)
        begun: tuple[str, ...] = ()
        for span in spans:
            part = re.search(r"(?:^|[ /&])quadvis ((?:(?! #|&&|   ).)+)", span)
            if part and not code and span.startswith("quadvis "):
                begun = tuple(shlex.split(part[1]))
                last = begun if line.startswith("| [") else last
            elif part and code:
                begun = tuple(shlex.split(part[1]))
            elif span.startswith("... ") and last:
                begun = (*last, *shlex.split(span[4:]))
            elif begun and begun[-2:-1] == ("--variant",) and re.fullmatch(r"\w+", span):
                begun = (*begun[:-1], span)
            else:
                continue
            if not _is_template(begun):
                found.append(Command(begun, line))
    return found


def _is_template(words: tuple[str, ...]) -> bool:
    """Whether a command has words to be replaced, such as FILE, or only names a command."""
    if len(words) < 2 or words[1].startswith("-"):
        return True
    return any(re.search(r"\b[A-Z]{3,}\b|[\[<|]|^\.\.\.$", word) for word in words)


STATED = list(
    {str(command): command for text in TEXTS.values() for command in stated_commands(text)}.values()
)
WITH_DIAGRAM = [
    command for command in STATED if command.words[0] in ("run", "check", "analyse", "draw", "sweep")
]


def test_the_commands_of_the_readmes_are_found() -> None:
    typed = {str(command) for command in STATED}
    assert {
        "run diagrams/hover.yaml",
        "run diagrams/hover.yaml --set 'bandwidth=1 rad/s'",
        "run diagrams/landing.yaml --variant robust_blackout",
        "sweep diagrams/hover.yaml --variant geometric --over seed=0..29",
        "plot runs/hover.mcap",
    } <= typed
    assert len(WITH_DIAGRAM) >= 30


@pytest.mark.parametrize("command", STATED, ids=str)
def test_a_command_of_a_readme_can_be_read(command: Command) -> None:
    assert command.options.command


@pytest.mark.parametrize("command", WITH_DIAGRAM, ids=str)
def test_the_diagram_of_a_command_has_no_fault_with_the_same_options(
    command: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    options = command.options
    if not Path(options.file).is_file():
        assert not options.file.startswith("diagrams/")  # the reader's own
        return
    settings = [text for text in options.set if not text.endswith(".yaml")]  # a file that the reader makes
    variants = options.variant if isinstance(options.variant, list) else [options.variant]
    for variant in variants or [None]:
        assert load(options.file, variant=variant, settings=settings, params=options.params).graph.nodes


def test_every_diagram_stands_in_the_table() -> None:
    missing = [
        path.name for path in (ROOT / "diagrams").glob("*.yaml") if f"]({path.name})" not in TEXTS[ROOMS[3]]
    ]
    assert missing == []


def test_every_variant_of_every_diagram_stands_in_the_table() -> None:
    text = TEXTS["diagrams/README.md"].partition("## The format")[0]
    stated = {(Path(command.options.file).name, str(command.options.variant)) for command in WITH_DIAGRAM}
    stated |= {(name, "rendered") for name in re.findall(r"\w+\.yaml", text) if "any of the five" in text}
    known = (*cases(), *with_programs())
    assert [case for case in known if case[1] is not None and case not in stated] == []


def table(text: str, heading: str) -> list[list[str]]:
    """Return the cells of the first table below a heading, without its own head."""
    lines = text.partition(f"\n## {heading}\n")[2].splitlines()
    start = next(
        number for number, (a, b) in enumerate(pairwise(lines)) if a.startswith("|") and set(b) <= set("|-")
    )
    rows = []
    for line in lines[start + 2 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]])
    return rows


SIGNATURES: dict[str, list[str]] = {}
for row in table(TEXTS["README.md"], "Commands"):
    for span in re.findall(r"`(quadvis [^`]+)`", row[0]):
        SIGNATURES.setdefault(span.split()[1], []).extend(span.split())  # some commands have several rows


def test_the_table_of_commands_has_every_command_and_no_other() -> None:
    assert SIGNATURES.keys() == COMMANDS.keys()


def stated_options(name: str) -> set[str]:
    return set(re.findall(r"(?<![\w-])--?[a-z][a-z-]*", " ".join(SIGNATURES[name])))


@pytest.mark.parametrize("name", COMMANDS)
def test_a_row_of_the_table_of_commands_has_no_option_that_does_not_exist(name: str) -> None:
    assert stated_options(name) <= set(COMMANDS[name]._option_string_actions)


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_stands_in_the_row_of_its_command_or_in_that_of_run(name: str) -> None:
    stated = stated_options(name) | stated_options("run")
    actions = [action.option_strings for action in COMMANDS[name]._actions]
    assert [flags for flags in actions if flags and "--help" not in flags and not stated & set(flags)] == []


def test_the_table_of_keys_has_the_row_of_every_section_and_no_other() -> None:
    rows = [f"| {' | '.join(row)} |" for row in table(TEXTS["diagrams/README.md"], "The format")]
    # What fails here is mended by writing this into the README.
    assert rows == [f"| `{section.key}` | {section.words} |" for section in SECTIONS]


@pytest.mark.parametrize("kind", [DIAGRAM, PART, GROUP])
def test_the_schema_has_every_key_and_no_other(kind: str) -> None:
    form = diagram_schema({})["else"]
    if kind != GROUP:
        form = form["else"]
    form = form["else" if kind == DIAGRAM else "then"]
    known = {*keys(kind, required=True), *keys(kind, required=False)}
    assert form["properties"].keys() == known == {each.key for each in SECTIONS if kind in each.kinds}


def test_every_section_is_in_the_list() -> None:
    assert sorted(type(section).__qualname__ for section in SECTIONS) == sorted(
        kind.__qualname__ for kind in (*FileSection.__subclasses__(), *RunSection.__subclasses__())
    )
    assert len({section.key for section in SECTIONS}) == len(SECTIONS)


def test_every_module_of_a_section_is_loaded_by_the_list() -> None:
    folder = ROOT / "quadvis" / "diagram" / "sections"
    names = {f"quadvis.diagram.sections.{path.stem}" for path in folder.glob("*.py")} - {
        "quadvis.diagram.sections.__init__"
    }
    assert names <= sys.modules.keys()


def test_every_tool_is_in_the_readme_and_no_other() -> None:
    stated = set(re.findall(r"`tools/(\w+)", TEXTS["README.md"]))
    files = {path.name for path in (ROOT / "tools").iterdir() if path.is_file() and not path.suffix}
    assert stated == files


@pytest.mark.parametrize("name", ROOMS)
def test_every_link_leads_somewhere(name: str) -> None:
    targets = re.findall(r"\]\(([^)#\s]+)\)", TEXTS[name])
    folder = (ROOT / name).parent
    assert [target for target in targets if "://" not in target and not (folder / target).exists()] == []


def test_the_times_of_the_readme_say_on_what_they_were_taken() -> None:
    before = (
        TEXTS["README.md"].partition("of wall time")[0]
        + TEXTS["README.md"].partition("of wall time")[2][:600]
    )
    assert all(word in before for word in ("one core of", "GHz", "Python 3.11", "numpy", "OpenCV"))


# What a real-time run loses depends on the machine; tests/diagrams/test_flight.py flies the bench. Other
# machines are not here; tests/quadvis/host/test_several.py makes some. Firmware may be missing, and one flies
# at a time: tests/diagrams/test_betaflight.py flies it.
RUNS = [
    command
    for command in STATED
    if command.words[0] in ("run", "analyse")
    and not {"--real-time", "--on", "--target"} & set(command.words)
    and Path(command.options.file).name not in {name for name, _ in with_programs()}
]


# This one is compiled and computed for a minute; tests/quadvis/analysis has quicker ones of its kind.
LONG = ("analyse diagrams/hover.yaml --variant fused_geometric --engine native",)


@pytest.mark.parametrize(
    "command",
    [
        pytest.param(command, marks=pytest.mark.long if str(command) in LONG else pytest.mark.slow)
        for command in RUNS
    ],
    ids=str,
)
def test_a_command_ends_as_its_readme_says(
    command: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    shutil.copytree(ROOT / "diagrams", tmp_path / "diagrams")
    monkeypatch.chdir(tmp_path)
    if not named_file(command.options.file).is_file():
        assert main(["new", "diagram", command.options.file]) == 0
    if "colours.yaml" in str(command):
        shutil.copy("diagrams/calib/colours.yaml", "colours.yaml")
    before = _contents(tmp_path / "diagrams")
    assert main(command.words) == (1 if FAILS in command.line else 0), capsys.readouterr()
    assert _contents(tmp_path / "diagrams") == before, "a diagram writes over what lies beside it"


def test_what_a_person_tries_stands_in_a_readme() -> None:
    assert {*LONG} <= {*map(str, RUNS)}


def _contents(folder: Path) -> dict[Path, bytes]:
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_the_licences_that_the_package_names_go_with_it() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert project["license"] == "BSD-3-Clause AND EPL-2.0 AND MIT"
    texts = [(ROOT / file).read_text(encoding="utf-8") for file in project["license-files"]]
    assert [text.partition("\n")[0].strip("# ") for text in texts] == [
        "BSD 3-Clause License",
        "Third-party works in quadvis",
        "Eclipse Public License - v 2.0",
        "The MIT License (MIT)",
    ]
    carried = {path.parent for path in (ROOT / "quadvis").rglob("*LICEN*")}
    assert carried == {(ROOT / file).parent for file in project["license-files"]} - {ROOT}


def test_nothing_that_is_made_by_running_is_tracked() -> None:
    found = subprocess.run(["git", "ls-files", "runs"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert found.stdout == ""
