from pathlib import Path

import pytest

import quadvis
from quadvis.realtime.devices import guards_all

TEXT = """\
quadvis: 1
name: loop
rates: {fast: 100 Hz}
stop_time: 1 s
blocks:
  wave: {block: sources.sine, rate: fast, with: {frequency: 1 Hz, amplitude: 1}}
"""
VALVE = """\
from quadvis.block import Block, In, Safe


class Valve(Block, numeric=False):
    \"\"\"Opens and shuts a valve.\"\"\"

    u = In()
    safe_u = Safe('u')

    def write(self, u: float) -> None:
        pass
"""


@pytest.mark.parametrize(
    ("more", "whole"),
    [
        ("", True),  # nothing needs safe values, so nothing can lack them
        ("  valve: {block: own.valve, rate: fast, with: {safe_u: 0}, in: {u: wave.y}}\n", False),
    ],
)
def test_only_what_writes_by_itself_can_be_without_its_safe_values(
    more: str, whole: bool, tmp_path: Path
) -> None:
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    (tmp_path / "blocks" / "own" / "valve.py").write_text(VALVE)
    (tmp_path / "loop.yaml").write_text(TEXT + more)
    assert guards_all(quadvis.load(tmp_path / "loop.yaml").graph) is whole
