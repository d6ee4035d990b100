"""quadvis.skeleton"""

import os
import subprocess
import sys

import pytest

import quadvis
from quadvis.errors import QuadvisError
from quadvis.skeleton import new_block, new_diagram


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_new_block_passes_its_own_test_and_runs_in_a_diagram_beside_it(folder):
    block, test = new_block("filters.my_lag")
    found = subprocess.run([sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", test], cwd=folder,
                           env=os.environ, capture_output=True, text=True, check=False)  # fmt: skip
    assert found.returncode == 0, found.stdout
    assert "2 passed" in found.stdout
    (diagram,) = new_diagram("loop.yaml")
    text = diagram.read_text().replace("signal.low_pass", "filters.my_lag").replace("time_constant: 0.5 s", "share: 0.1")
    diagram.write_text(text)
    result = quadvis.load(diagram).run()
    # 300 ticks of 10 ms after the step at 1 s, the tick of the step included: 1 - 0.9^301.
    assert result["lag.y"][400] == pytest.approx(1 - 0.9**301, rel=1e-12)


def test_a_new_block_in_the_library_lies_where_the_library_is(folder):
    (folder / "blocks" / "quadvis_blocks").mkdir(parents=True)
    block, test = new_block("signal.my_lag")
    assert block.as_posix() == "blocks/quadvis_blocks/signal/my_lag.py"
    assert test.as_posix() == "tests/blocks/signal/test_my_lag.py"
    assert "from quadvis_blocks.signal.my_lag import MyLag" in test.read_text()


def test_a_new_diagram_meets_its_expectation():
    (diagram,) = new_diagram("loop.yaml")
    assert quadvis.load(diagram).run().passed


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("My.Block", "cannot name a block; write group.name in lower case"),
        ("../evil", "cannot name a block"),
        ("signal.derivative", "is in the standard library"),
    ],
)
def test_a_name_that_no_block_can_have_is_refused(folder, name, words):
    with pytest.raises(QuadvisError, match=words):
        new_block(name)
    assert list(folder.iterdir()) == []


def test_nothing_is_overwritten(folder):
    new_block("mine")
    (folder / "tests" / "blocks" / "test_mine.py").write_text("precious")
    (folder / "blocks" / "mine.py").unlink()
    with pytest.raises(QuadvisError, match="is there already"):
        new_block("mine")
    assert (folder / "tests" / "blocks" / "test_mine.py").read_text() == "precious"
    assert not (folder / "blocks" / "mine.py").exists()
    new_diagram("loop.yaml")
    with pytest.raises(QuadvisError, match="'loop.yaml' is there already"):
        new_diagram("loop.yaml")


def test_a_diagram_must_be_a_yaml_file():
    with pytest.raises(QuadvisError, match=r"'loop.txt' is not a YAML file; write a name such as loop.yaml"):
        new_diagram("loop.txt")
