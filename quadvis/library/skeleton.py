"""Write skeletons that run at once, for `quadvis new`: a block, an output device, a diagram, a project."""

from __future__ import annotations

import keyword
import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

from quadvis.errors import QuadvisError
from quadvis.library.catalogue import STANDARD, Catalogue
from quadvis.library.device_skeleton import DEVICE, DEVICE_GIVEN, DEVICE_TEST
from quadvis.library.project_skeleton import FILES, PLAIN
from quadvis.machine.files import Kind, reason, write_output
from quadvis.version import __version__

SKELETON = Kind("the skeleton")
# Names that the skeletons import.
TAKEN = ("Any", "Block", "In", "Initial", "Line", "Out", "Output", "Param", "Safe", "State", "Work")

BLOCK = '''"""{title}."""

from __future__ import annotations

from typing import Any

from quadvis.block import Block, In, Out, Param, State, Work


class {name}(Block):
    """First-order lag of a signal: what the block does, in one sentence.

    ``y[k] = y[k-1] + share * (u[k] - y[k-1])``, from zero. Say here where it comes from
    and how far it holds.
    """

    share = Param(0.5, above=0.0, max=1.0, tune=True, doc="part of the way per tick")
    u = In(unit="a", doc="the signal")
    y = Out(unit="a", doc="the lagged signal")
    last = State()
    lagged = Work()

    def output(self, u: Any) -> Any:
        """Return the lagged signal."""
        self.lagged = self.last + self.share * (u - self.last)
        return self.lagged

    def update(self) -> None:
        """Keep it for the next tick."""
        self.last = self.lagged
'''

TEST = '''"""Tests of the block {path}."""

{head}

def test_a_step_is_followed_by_a_geometric_row() -> None:
    y = drive({name}(share=0.5), u=[1.0] * 5, rate="10 Hz").y
    assert y == pytest.approx([0.5, 0.75, 0.875, 0.9375, 0.96875])


def test_a_share_above_one_is_refused() -> None:
    with pytest.raises(ParameterError, match="share must be at most 1"):
        {name}(share=1.5)
'''

OWN_HEAD = """from pathlib import Path
{typing}
import pytest
from quadvis.block import ParameterError
from quadvis.library.catalogue import Catalogue
from quadvis.testing import check_block, {drive}

BLOCKS = Catalogue(Path(__file__).parents[{up}])
{name} = BLOCKS.find("{path}")
{given}

def test_it_does_what_every_block_must_do() -> None:
    check_block({name}, {with_given}test=Path(__file__))
"""

STANDARD_HEAD = """{typing}{gap}import pytest

from quadvis.block import ParameterError
from quadvis.testing import {drive}
from {module} import {name}
{gap}{given}"""


class Skeleton(NamedTuple):
    """The texts of a block and of its test; ``words`` are what the head of the test needs."""

    block: str
    test: str
    words: Mapping[str, str]


KINDS = {
    "block": Skeleton(
        BLOCK, TEST, {"drive": "drive", "given": "", "gap": "", "typing": "", "with_given": ""}
    ),
    "device": Skeleton(
        DEVICE,
        DEVICE_TEST,
        {
            "drive": "drive_output",
            "given": DEVICE_GIVEN,
            "gap": "\n",
            "typing": "from typing import Any\n",
            "with_given": "given=GIVEN, ",
        },
    ),
}

DIAGRAM = """# A signal through a lag: change it into your own.
# `quadvis list` shows all blocks, and the parts that come with quadvis; `quadvis describe NAME` one of them.
quadvis: 1
name: {name}
doc: What this diagram is for.

rates: {{fast: 100 Hz}}
stop_time: 5 s

blocks:
  source:
    block: sources.step
    rate: fast
    with: {{before: 0 m, after: 1 m, at: 1 s}}
  lag:
    block: signal.low_pass
    rate: fast
    with: {{time_constant: 0.5 s}}
    in: {{u: source.y}}

expect:
  - {{signal: lag.y, after: 4 s, within: 1 cm, of: 1 m}}

summary:
  lag: {{signal: lag.y, show: [final, max], unit: cm}}

figures:
  - title: Step response
    panels:
      - {{signals: [source.y, lag.y], unit: cm}}
"""


def new_block(name: str, kind: str = "block") -> list[Path]:
    """Write a block, or a device, and its test below the working directory, and return both paths.

    In a folder with the standard library they go there, otherwise into ``blocks/`` and ``tests/``.
    QuadvisError if the name is not a valid name of a block or is in use, or if a file exists.
    """
    if re.fullmatch(r"[a-z][a-z0-9_]*(\.[a-z][a-z0-9_]*)*", name) is None:
        raise QuadvisError(
            f"'{name}' cannot name a block; write group.name in lower case, such as signal.my_filter"
        )
    *groups, last = name.split(".")
    class_name = "".join(part.capitalize() for part in last.split("_"))
    if any(map(keyword.iskeyword, (*groups, last))) or class_name in TAKEN:
        raise QuadvisError(
            f"'{name}' cannot name a block, since Python uses a word of it; choose another name"
        )
    if name in Catalogue().names():
        raise QuadvisError(f"'{name}' is in the standard library; choose another name")
    library = Path("blocks", STANDARD)
    ours = library.is_dir()
    block = Path(library if ours else "blocks", *groups, f"{last}.py")
    test = Path("tests", "blocks", *groups, f"test_{last}.py")
    _refuse_existing(block, test)
    skeleton = KINDS[kind]
    title = last.replace("_", " ").capitalize()
    words = {"name": class_name, "path": name, "title": title, **skeleton.words}
    head = STANDARD_HEAD.format(module=f"{STANDARD}.{name}", **words) if ours else OWN_HEAD.format(
        up=len(test.parts) - 1, **words
    )  # fmt: skip
    _write(block, skeleton.block.format(**words))
    _write(test, skeleton.test.format(head=head, **words))
    return [block, test]


def new_diagram(file: str) -> list[Path]:
    """Write a small diagram that runs, and return its path; QuadvisError if the file exists."""
    path = Path(file)
    if path.suffix not in (".yaml", ".yml"):
        raise QuadvisError(f"'{file}' is not a YAML file; write a name such as loop.yaml")
    if re.fullmatch(r"[A-Za-z_][\w-]*", path.stem, re.ASCII) is None:
        raise QuadvisError(f"'{path.stem}' cannot name a diagram; use letters, digits, '_' and '-'")
    _refuse_existing(path)
    _write(path, DIAGRAM.format(name=path.stem))
    return [path]


def new_project(name: str) -> list[Path]:
    """Write a folder with a diagram, a calibration, a block, tests and CI; return the paths of its files.

    QuadvisError if the name cannot be that of a diagram, or if there is such a folder.
    """
    folder = Path(name)
    if re.fullmatch(r"[A-Za-z_]\w*", folder.name, re.ASCII) is None or keyword.iskeyword(folder.name):
        raise QuadvisError(f"'{folder.name}' cannot name a project; use letters, digits and '_'")
    _refuse_existing(folder)
    words = {"name": folder.name, "version": __version__}
    made = {folder / path.format(**words): text for path, text in FILES.items()}
    for path, text in made.items():
        _write(path, text if text in PLAIN else text.format(**words))
    return list(made)


def _refuse_existing(*paths: Path) -> None:
    for path in paths:
        if path.exists():
            raise QuadvisError(f"'{path}' is there already; choose another name, or remove it")


def _write(path: Path, text: str) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise QuadvisError(f"cannot write '{path}': {reason(error)}") from error
    write_output(path, SKELETON, text)
