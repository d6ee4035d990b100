"""`quadvis list`: all blocks in one line each, without importing them, and the search by words."""

from __future__ import annotations

import inspect
import subprocess
import sys
from pathlib import Path

import pytest

from quadvis.errors import QuadvisError
from quadvis.library.catalogue import Catalogue
from quadvis.library.listing import lines, listed_blocks, listed_files, matching


def test_what_is_read_from_a_file_is_what_its_class_says() -> None:
    catalogue = Catalogue()
    listed, failures = listed_blocks(catalogue)
    assert failures == []
    assert [each.name for each in listed] == catalogue.names()
    for each in listed:
        assert each.text == inspect.getdoc(catalogue.find(each.name))
        assert each.headline.endswith(".")


def test_a_line_has_the_name_and_the_first_sentence() -> None:
    listed, _ = listed_blocks(Catalogue())
    for line, each in zip(lines(listed), listed, strict=True):
        assert line.startswith(f"{each.name} ") and line.endswith(f" {each.headline}")


def test_own_blocks_are_loaded_and_broken_ones_reported(tmp_path: Path) -> None:
    folder = tmp_path / "blocks" / "own"
    folder.mkdir(parents=True)
    (folder / "broken.py").write_text("import nothing_like_it\n")
    (folder / "sound.py").write_text(
        'from quadvis.block import Block, Out\n\n\nclass Sound(Block):\n    """Own words."""\n\n'
        "    y = Out()\n\n    def output(self):\n        return 1.0\n"
    )
    listed, failures = listed_blocks(Catalogue(tmp_path))
    assert ("own.sound", "Own words.", "Own words.") in listed
    assert len(failures) == 1 and "own.broken" in failures[0]


@pytest.mark.parametrize(
    ("words", "first"),
    [
        ("transport", "signal.transport_delay"),
        ("Dead Time", "signal.transport_delay"),
        ("anti-windup", "systems.pid"),
        ("anti windup", "systems.pid"),
        ("lead lag", "systems.transfer_function"),
        ("discrete derivative", "signal.derivative"),
        ("quantization", "signal.quantizer"),
        ("dead-time", "signal.transport_delay"),
        ("Mux", "signal.concatenate"),
        ("RelationalOperator", "logic.compare"),
        ("craft mjcf", "plant.mujoco_rotorcraft"),
        ("hover.yaml", "quadvis:hover.yaml"),
    ],
)
def test_words_find_a_block_by_its_name_its_text_or_as_others_call_it(words: str, first: str) -> None:
    everything = [*listed_blocks(Catalogue())[0], *listed_files()]
    assert matching(everything, words.split())[0].name == first


def test_all_words_must_be_there_and_names_come_first() -> None:
    listed, _ = listed_blocks(Catalogue())
    found = [each.name for each in matching(listed, ["delay"])]
    assert found[:4] == ["logic.on_delay", "signal.delay", "signal.transport_delay", "signal.unit_delay"]
    assert "estimation.predictor" in found[4:]
    assert {each.name for each in matching(listed, ["delay", "radio"])} < set(found)


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["saturatoin"], "nothing has the word 'saturatoin'; did you mean 'signal.saturation'?"),
        (["xyzzy", "delay"], "nothing has the words 'xyzzy' and 'delay'; quadvis list shows all"),
    ],
)
def test_words_that_nothing_has_get_a_sentence(words: list[str], sentence: str) -> None:
    with pytest.raises(QuadvisError) as caught:
        matching(listed_blocks(Catalogue())[0], words)
    assert str(caught.value) == sentence


COUNT = """
import cProfile, pstats, sys

def counted(*words):
    profile = cProfile.Profile()
    profile.enable()
    from quadvis.cli import main
    code = main(words)
    profile.disable()
    others = [name for name in sys.modules if not name.startswith("quadvis")]
    heavy = {"numpy", "yaml", "numba", "scipy", "cv2", "importlib.metadata"} & {*sys.modules}
    print(code, len(others), pstats.Stats(profile).total_calls, *sorted(heavy))

counted("list")
counted("describe", "signal.derivative")
"""


def test_a_list_starts_quickly_without_numpy_and_a_description_with_little_more() -> None:
    found = subprocess.run([sys.executable, "-c", COUNT], capture_output=True, text=True, check=True)
    lines = found.stdout.splitlines()
    listed = next(line for line in lines if line.startswith("0 "))
    code, modules, calls, *heavy = listed.split()
    assert (code, heavy) == ("0", [])
    assert int(modules) < 130  # beside our own
    assert int(calls) < 150_000  # a tenth of a second of CPU; each block and each shipped file adds some
    code, modules, calls, *heavy = lines[-1].split()
    assert (code, heavy) == ("0", ["numpy"])  # which a class of a block needs
    assert int(modules) < 260
    assert int(calls) < 250_000
