"""The models of the textbooks: as few blocks as the originals, and the results of independent solutions."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import quadvis
from quadvis.run.result import Result
from tests.diagrams.textbook import MODELS

FOLDER = Path(__file__).parents[2] / "diagrams" / "textbook"
ROW = re.compile(r"\| \[(\w+)\.yaml\]\(\1\.yaml\) \| [^|]+: ([^|]+) \| (\d+) \| (\d+) \|")
TOLERANCE = 1e-6  # of the largest value of a signal


class Counts(NamedTuple):
    """A row of the table: the blocks of the original by kind, their number, and that of ours."""

    kinds: str
    theirs: int
    ours: int


ROWS = {
    name: Counts(kinds, int(theirs), int(ours))
    for name, kinds, theirs, ours in ROW.findall((FOLDER / "README.md").read_text(encoding="utf-8"))
}


def compared(name: str, result: Result) -> float:
    """Return the largest difference from the independent solution, over the largest value of its signal."""
    signals, solution = MODELS[name]
    names = (signals,) if isinstance(signals, str) else signals
    time = result.times(names[0])
    right = solution(time).reshape(len(time), -1)
    found = np.column_stack([result[signal] for signal in names])
    assert found.shape == right.shape
    return float((np.abs(found - right).max(axis=0) / np.abs(right).max(axis=0)).max())


def test_the_table_and_the_solutions_know_every_model() -> None:
    files = sorted(path.stem for path in FOLDER.glob("*.yaml"))
    assert files == sorted(ROWS) == sorted(MODELS)
    assert len(files) >= 20


def number(kind: str) -> int:
    """Return how many blocks a text such as "3 sums" or "step" stands for."""
    word = kind.partition(" ")[0]
    return int(word) if word.isdigit() else 1


@pytest.mark.parametrize("name", ROWS)
def test_no_model_has_more_blocks_than_its_original(name: str) -> None:
    kinds, theirs, ours = ROWS[name]
    assert sum(map(number, kinds.split(", "))) == theirs
    diagram = quadvis.load(FOLDER / f"{name}.yaml")
    assert len(diagram.graph.nodes) == ours <= theirs
    assert not diagram.warnings


@pytest.mark.parametrize("name", MODELS)
def test_a_model_gives_the_results_of_an_independent_solution(name: str) -> None:
    result = quadvis.load(FOLDER / f"{name}.yaml").run(engine="python")
    assert compared(name, result) < TOLERANCE
    assert result.passed


@pytest.mark.slow
@pytest.mark.parametrize("name", MODELS)
def test_machine_code_gives_the_same_bits(name: str) -> None:
    diagram = quadvis.load(FOLDER / f"{name}.yaml")
    first, second = diagram.run(engine="python"), diagram.run(engine="native")
    assert [*first] == [*second]
    assert all(first[signal].tobytes() == second[signal].tobytes() for signal in first)
