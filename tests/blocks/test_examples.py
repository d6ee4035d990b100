"""The examples that `quadvis describe` shows: each is a diagram that runs, or one that `check` accepts."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from quadvis.api import Diagram, load_text
from quadvis.block import Block, Device
from quadvis.graph.graph import Node
from quadvis.library.catalogue import Catalogue
from quadvis.library.describe import description, example_diagram, only_checked
from quadvis.realtime.options import RealTime
from tests.fmus import models
from tests.fmus.builder import fmu

CATALOGUE = Catalogue()
NAMES = CATALOGUE.names()
CHECKED = [name for name in NAMES if only_checked(CATALOGUE.find(name))]
LONGEST = 20  # lines of an example, so that it can be pasted
FLOWN = ("hardware.message_out", "hardware.sbus_in", "hardware.sbus_out")  # whose lines are cables


def bouncing_ball(folder: Path) -> None:
    """Put the FMU that an example plays into a folder."""
    if shutil.which("gcc") is None:
        pytest.skip("compiles an FMU, with gcc")
    shutil.copy(fmu(models.BALL), folder / "BouncingBall.fmu")


FILES: dict[str, Callable[[Path], None]] = {"fmi.fmu": bouncing_ball}  # what examples need, made by a test


def loaded(name: str, folder: Path, more: str = "") -> Diagram:
    """Return the diagram of a block's example, and more of it, with the files that it needs."""
    FILES.get(name, lambda folder: None)(folder)
    diagram = load_text(example_diagram(name, CATALOGUE.find(name)) + more, folder)
    assert not diagram.warnings
    return diagram


def node_of(name: str, diagram: Diagram) -> Node:
    """Return the first node of a kind of block."""
    return next(node for node in diagram.graph.nodes if node.kind == name)


def test_every_block_has_a_short_example() -> None:
    lines = {name: len(CATALOGUE.find(name).example.strip().splitlines()) for name in NAMES}
    assert {name: count for name, count in lines.items() if not 0 < count <= LONGEST} == {}


def test_only_devices_and_what_needs_something_are_not_run() -> None:
    others = {name for name in CHECKED if not issubclass(CATALOGUE.find(name), Device)}
    assert others == {"fmi.fmu", "firmware.betaflight"}
    assert only_checked(CATALOGUE.find("fmi.fmu")) == "it needs an FMU of this name"
    assert only_checked(Block) == ""


@pytest.mark.parametrize("name", [name for name in NAMES if name not in CHECKED or name in FILES])
def test_an_example_runs_and_has_its_block(name: str, tmp_path: Path) -> None:
    diagram = loaded(name, tmp_path)
    node = node_of(name, diagram)
    result = diagram.run()
    assert all(
        f"{node.path}.{port}" in result or declared.type == "frame"
        for port, declared in node.block.interface.outputs.items()
    )
    block = CATALOGUE.find(name)
    assert block.example.strip().splitlines()[0].strip() in description(name, block)


@pytest.mark.parametrize("name", [name for name in CHECKED if name not in FILES])
def test_an_example_of_a_device_passes_the_check(name: str, tmp_path: Path) -> None:
    diagram = loaded(name, tmp_path)
    assert node_of(name, diagram).kind == name


@pytest.mark.slow
@pytest.mark.parametrize("name", FLOWN)
def test_an_example_of_a_device_on_a_cable_flies(name: str, tmp_path: Path) -> None:
    diagram = loaded(name, tmp_path, "overload: {action: warn}\n")
    node = node_of(name, diagram)
    result = diagram.run(real_time=RealTime())
    assert result.duration == 1.0
    assert all(f"{node.path}.{port}" in result for port in node.block.interface.outputs)
