"""No shipped diagram changes its hash or its signals unnoticed: see golden.py for how to renew the file."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import pytest

from tests.diagrams.golden import DIAGRAMS, FILE, cases, facts, title

GOLDEN = json.loads(FILE.read_text())


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the diagrams, so that what a diagram writes beside itself stays out of the repository."""
    return Path(shutil.copytree(DIAGRAMS, tmp_path_factory.mktemp("repository") / "diagrams"))


def test_the_golden_file_knows_every_diagram_and_variant() -> None:
    assert list(GOLDEN) == [title(*case) for case in cases()]


@pytest.mark.parametrize(("name", "variant"), cases())
def test_hash_and_signals_are_those_of_the_golden_file(folder: Path, name: str, variant: str | None) -> None:
    found, golden = facts(folder, name, variant), GOLDEN[title(name, variant)]
    assert found["hash"] == golden["hash"]
    assert found["signals"] == pytest.approx(golden["signals"], rel=1e-6, abs=1e-9)
