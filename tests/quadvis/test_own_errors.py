"""A mistake in one's own block is reported with its line, and with what the method must return."""

from __future__ import annotations

from pathlib import Path

import pytest

from quadvis.api import load
from quadvis.errors import DiagramError, RunError

BLOCK = '''"""A block."""

from quadvis.block import Block, In, Out


class Mine(Block):
    """My block."""

    u = In(doc="u")
    y = Out(doc="y")
    z = Out("float64[2]", doc="z")

    def output(self, u):
        if u > 0.0:
            return RETURNED
        return u, [u, u]
'''
LINE = 15
DIAGRAM = """quadvis: 1
name: loop
rates: {fast: 10 Hz}
stop_time: 1 s
blocks:
  one: {block: sources.ramp, rate: fast, with: {slope: 1 1/s}}
  b: {block: mine, rate: fast, in: {u: one.y}}
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "blocks").mkdir()
    (tmp_path / "loop.yaml").write_text(DIAGRAM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize(
    ("returned", "sentence"),
    [
        ("u, u, 3", "output must return 2 values (y, z), it returned 3"),
        ("u", "output must return 2 values (y, z), it returned 0.1"),
        ("u, [1, 2, 3]", "output must return float64 of shape (2,) for z, it returned [1, 2, 3]"),
        ("u, [[1], [2, 3]]", "output must return float64 of shape (2,) for z, it returned [[1], [2, 3]]"),
        ("'a', [u, u]", "output must return float64 for y, it returned 'a'"),
        ("None", "output must return 2 values (y, z), it returned None"),
        ("self.no, u", "AttributeError: 'Mine' object has no attribute 'no'"),
        ("u, [u / 0, u]", "a division by zero"),
    ],
)
def test_a_method_that_fails_is_reported_with_its_line(returned: str, sentence: str, folder: Path) -> None:
    (folder / "blocks" / "mine.py").write_text(BLOCK.replace("RETURNED", returned))
    with pytest.raises(RunError) as caught:
        load("loop.yaml").run()
    assert f"block 'b', t = 0.1 s: {sentence} in blocks/mine.py:{LINE}" in str(caught.value).replace(
        ".z,", ","
    )


@pytest.mark.parametrize(
    ("before", "after", "where"),
    [
        ("(self, u)", "(self, v)", "blocks/mine.py:6: TypeError: Mine.output asks for 'v'"),
        ("(self, u)", "(self, u", "blocks/mine.py:13: SyntaxError: '(' was never closed"),
        ("import Block, In", "import Block, Inn, In", "blocks/mine.py:3: ImportError: "),
    ],
)
def test_a_block_that_cannot_be_loaded_is_reported_with_its_line(
    before: str, after: str, where: str, folder: Path
) -> None:
    (folder / "blocks" / "mine.py").write_text(BLOCK.replace("RETURNED", "u").replace(before, after))
    with pytest.raises(DiagramError) as caught:
        load("loop.yaml")
    assert f"block 'mine' cannot be loaded from {where}" in str(caught.value)
