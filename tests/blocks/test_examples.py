"""The examples that `quadvis describe` shows: each is a diagram that runs."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import description, example_diagram

CATALOGUE = Catalogue()
GENERAL = (
    "logic",
    "math",
    "rotation",
    "signal",
    "sources",
    "systems",
)  # the groups for everyone: all of their blocks have an example
WITHOUT = {"sources.recording": "it plays a log"}
NAMES = [name for name in CATALOGUE.names() if CATALOGUE.find(name).example]


def test_every_general_block_has_an_example() -> None:
    missing = {name for name in CATALOGUE.names() if name.partition(".")[0] in GENERAL and name not in NAMES}
    assert missing == {*WITHOUT}


@pytest.mark.parametrize("name", NAMES)
def test_an_example_runs_and_has_its_block(name: str, tmp_path: Path) -> None:
    block = CATALOGUE.find(name)
    diagram = load_text(example_diagram(name, block), tmp_path)
    assert not diagram.warnings
    (node, *_) = (node for node in diagram.graph.nodes if node.kind == name)
    result = diagram.run()
    assert all(f"{node.path}.{port}" in result for port in node.block.interface.outputs)
    assert block.example.strip().splitlines()[0].strip() in description(name, block)
