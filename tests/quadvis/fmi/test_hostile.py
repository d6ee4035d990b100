"""Hostile archives are refused in one sentence, hostile native code is survived."""

from __future__ import annotations

import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from quadvis.api import load_text
from quadvis.block import ParameterError
from quadvis.errors import QuadvisError, RunError
from quadvis.testing import drive
from quadvis_blocks.fmi.fmu import Fmu
from tests.fmus.bombs import ARCHIVES, NATIVE, SLOW
from tests.fmus.builder import fmu, needs_gcc

RUNS = ("a library that is none", "a bomb that announces little")  # what only a run finds out
WRITING = '''"""A block that writes."""

from quadvis.block import Block, In, Param, Safe


class Valve(Block, numeric=False):
    """Writes what it gets into a file, and its safe value at the end."""

    u = In("int64", doc="position")
    safe = Safe("u", doc="closed")
    path = Param(type="str", doc="file")

    def write(self, u):
        with open(self.path, "a") as file:
            file.write(f"{u}\\n")
'''
LOOP = """\
quadvis: 1
name: loop
rates: {{fast: 10 Hz}}
stop_time: 2 s
blocks:
  bad: {{block: fmi.fmu, rate: fast, with: {{file: {file}, deadline: 0.5 s}}}}
  valve: {{block: valve, rate: fast, with: {{safe: -1, path: {path}}}, in: {{u: bad.counter}}}}
"""


def left() -> set[Path]:
    """Return what is in the places to which the archives lead."""
    return {path for place in ("/", "/tmp") for path in Path(place).glob("*escaped*")}


@pytest.fixture(autouse=True)
def nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let all be unpacked in a folder of the test, and look whether it is empty afterwards."""
    home, around = tmp_path / "inside", left()
    home.mkdir()
    monkeypatch.setattr("tempfile.tempdir", str(home))
    yield
    assert not list(home.iterdir()), "the unpacked copy is still there"
    assert left() == around
    assert not list(tmp_path.glob("*escaped*"))


BIG = ("many elements", "a bomb", "an endless attribute")


@pytest.mark.faults
@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[pytest.mark.slow] * (name in BIG)) for name in ARCHIVES]
)
def test_a_hostile_archive_is_refused_in_a_sentence(name: str, tmp_path: Path) -> None:
    make, words = ARCHIVES[name]
    path = tmp_path / "hostile.fmu"
    make(path)
    before, begin = set(tmp_path.rglob("*")), time.process_time()
    with pytest.raises(QuadvisError, match=words) as caught:
        made = Fmu(file=str(path))
        assert name in RUNS, "a check finds it"
        drive(made, rate="10 Hz", steps=2)
    assert isinstance(caught.value, ParameterError) == (name not in RUNS)
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 500
    assert time.process_time() - begin < 20.0  # of the processor: nothing is read beyond the limits
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.faults
@needs_gcc
@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[] if name in ("exit", "error") else pytest.mark.slow) for name in NATIVE],
)
def test_a_run_survives_what_an_fmu_does_and_says_what_it_was(name: str) -> None:
    model, words = NATIVE[name]
    block = Fmu(file=fmu(model, 2), deadline=0.5)
    with pytest.raises(RunError, match=words) as caught:
        drive(block, rate="10 Hz", steps=5)
    assert "block 'block'" in str(caught.value) and "t = " in str(caught.value)


@needs_gcc
@pytest.mark.slow
@pytest.mark.parametrize("name", ["foreign memory", "hang", "exit", "discard"])
def test_the_same_goes_for_fmi_3(name: str) -> None:
    model, words = NATIVE[name]
    with pytest.raises(RunError, match=words):
        drive(Fmu(file=fmu(model, 3), deadline=0.5), rate="10 Hz", steps=5)


@pytest.mark.faults
@needs_gcc
@pytest.mark.parametrize("name", ["foreign memory", pytest.param("hang", marks=pytest.mark.slow)])
def test_what_follows_ends_at_its_safe_value(name: str, tmp_path: Path) -> None:
    (tmp_path / "blocks").mkdir()
    (tmp_path / "blocks" / "valve.py").write_text(WRITING)
    written = tmp_path / "written"
    text = LOOP.format(file=fmu(NATIVE[name][0], 2), path=written)
    with pytest.raises(RunError, match=r"block 'bad', t = 0\.1 s: "):
        load_text(text, tmp_path).run()
    assert written.read_text().split() == ["1", "-1"]


@needs_gcc
def test_a_slow_fmu_is_waited_for(tmp_path: Path) -> None:
    assert drive(Fmu(file=fmu(SLOW, 2)), rate="1 kHz", steps=4).counter.tolist() == [1, 2, 3, 4]


@needs_gcc
def test_a_warning_can_be_accepted() -> None:
    found = drive(Fmu(file=fmu(NATIVE["warning"][0], 2), warnings=True), rate="10 Hz", steps=3)
    assert found.counter.tolist() == [1, 1, 1]
