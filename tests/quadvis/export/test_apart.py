"""A block type that another process writes in C, since this one has compiled code with vectors."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.engine.engine import Engine
from quadvis.errors import QuadvisError
from quadvis.export import blocks
from quadvis.export.blocks import VectorFound, block_code
from quadvis.native import cache

OWN = '''\
"""A block of one's own."""

from quadvis.block import Block, In, Out


def doubled(u):
    """Return twice as much."""
    return 2.0 * u


class Twice(Block):
    """Twice the input."""

    u = In()
    y = Out()

    def output(self, u):
        return doubled(u)
'''
TEXT = """\
quadvis: 1
name: twice
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  ramp: {block: sources.ramp, rate: fast, with: {slope: 1 1/s}}
  twice: {block: own.twice, rate: fast, in: {u: ramp.y}}
"""


@pytest.mark.slow
def test_another_process_writes_the_same_also_of_own_blocks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    (tmp_path / "blocks" / "own" / "twice.py").write_text(OWN)
    diagram = load_text(TEXT, tmp_path)
    program, listed = Engine(diagram.graph).program, [node.block for node in diagram.graph.nodes]
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "here"))
    here = block_code(program, listed)
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "there"))

    def vectors(*_: object) -> str:
        raise VectorFound

    monkeypatch.setattr(blocks, "written", vectors)
    assert block_code(program, listed) == here


@pytest.mark.slow
def test_what_it_refuses_is_a_sentence(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    wrong = OWN.replace("return 2.0 * u", "return {}[u]")
    (tmp_path / "blocks" / "own" / "twice.py").write_text(wrong)
    diagram = load_text(TEXT, tmp_path)
    program, listed = Engine(diagram.graph).program, [node.block for node in diagram.graph.nodes]
    monkeypatch.setenv(cache.FOLDER, str(tmp_path / "there"))

    def vectors(*_: object) -> str:
        raise VectorFound

    monkeypatch.setattr(blocks, "written", vectors)
    with pytest.raises(QuadvisError, match=r"^block 'twice' \(Twice\) cannot be written in C: "):
        block_code(program, listed)
