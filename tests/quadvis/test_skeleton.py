"""What `quadvis new` writes runs at once, and nothing is ever written over."""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from quadvis.api import load
from quadvis.diagram.key_order import key_ranks
from quadvis.document.style import formatted
from quadvis.errors import QuadvisError
from quadvis.library.skeleton import new_block, new_diagram, new_project


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_new_block_is_found_by_a_diagram_beside_it_and_passes_its_test(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    paths = new_block("signal.my_filter")
    assert paths == [Path("blocks/signal/my_filter.py"), Path("tests/blocks/signal/test_my_filter.py")]
    (project / "loop.yaml").write_text(
        "quadvis: 1\nname: loop\nrates: {fast: 10 Hz}\nstop_time: 0.4 s\nblocks:\n"
        "  one: {block: sources.constant, rate: fast, with: {value: 1 m}}\n"
        "  lag: {block: signal.my_filter, rate: fast, with: {share: 0.5}, in: {u: one.y}}\n"
    )
    result = load("loop.yaml").run()
    assert result["lag.y"] == pytest.approx([0.5, 0.75, 0.875, 0.9375, 0.96875])
    assert result.units["lag.y"] == "m"
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    done = subprocess.run([sys.executable, "-m", "pytest", "-q"], capture_output=True, text=True)
    assert (done.returncode, "3 passed" in done.stdout) == (0, True), done.stdout


@pytest.mark.slow
def test_a_new_device_passes_its_test(monkeypatch: pytest.MonkeyPatch) -> None:
    new_block("hardware.my_board", "device")
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    done = subprocess.run([sys.executable, "-m", "pytest", "-q"], capture_output=True, text=True)
    assert (done.returncode, "3 passed" in done.stdout) == (0, True), done.stdout


@pytest.mark.parametrize("kind", ["block", "device"])
@pytest.mark.parametrize("name", ["fan", "signal.my_filter", "control.position_integrator"])
@pytest.mark.parametrize("ours", [False, True], ids=["own", "standard"])
def test_what_is_written_is_as_ruff_wants_it(name: str, ours: bool, kind: str, project: Path) -> None:
    ruff = [sys.executable, "-m", "ruff"]
    if ours:
        (project / "blocks" / "quadvis_blocks").mkdir(parents=True)
        (project / "quadvis").mkdir()
        for module in ("quadvis/block", "quadvis/testing", "blocks/quadvis_blocks/__init__"):
            (project / f"{module}.py").touch()  # so that ruff knows them as this project's
        shutil.copy(Path(__file__).parents[2] / "pyproject.toml", project)
    paths = [str(path) for path in new_block(name, kind)]
    options = [] if ours else ["--select", "E,F,I,B,UP,SIM,RUF"]
    for command in (["format", "--diff"], ["check", "--no-cache", *options]):
        done = subprocess.run([*ruff, *command, *paths], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["block", "device"])
def test_what_is_written_is_as_mypy_wants_it(kind: str) -> None:
    paths = [str(path) for path in new_block("signal.my_filter", kind)]
    command = [sys.executable, "-m", "mypy", "--strict", *paths]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_the_test_of_a_new_block_finds_a_breach_of_the_contract(
    project: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    block, test = new_block("signal.my_filter")
    text = block.read_text()
    block.write_text(
        text.replace("        return self.lagged", "        self.last += u\n        return self.lagged")
    )
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    done = subprocess.run([sys.executable, "-m", "pytest", "-q", str(test)], capture_output=True, text=True)
    assert (done.returncode, "test_it_does_what_every_block_must_do" in done.stdout) == (1, True), done.stdout


def test_a_new_block_of_the_standard_library_goes_there(project: Path) -> None:
    (project / "blocks" / "quadvis_blocks").mkdir(parents=True)
    block, test = new_block("signal.my_filter")
    assert block == Path("blocks/quadvis_blocks/signal/my_filter.py")
    assert "from quadvis_blocks.signal.my_filter import MyFilter" in test.read_text()


def test_a_new_diagram_runs_and_meets_what_it_expects() -> None:
    (path,) = new_diagram("loop.yaml")
    assert path == Path("loop.yaml")
    assert load(path).run().passed


def test_a_new_diagram_may_go_into_a_new_folder() -> None:
    (path,) = new_diagram("mine/loop.yaml")
    assert load(path).name == "loop"


@pytest.mark.parametrize(
    ("name", "reason"),
    [
        ("Signal.Filter", "cannot name a block"),
        ("signal.2nd", "cannot name a block"),
        ("signal filter", "cannot name a block"),
        ("../filter", "cannot name a block"),
        ("signal._hidden", "cannot name a block"),
        ("", "cannot name a block"),
        ("signal.", "cannot name a block"),
        ("signal.lambda", "since Python uses a word of it"),
        ("class.filter", "since Python uses a word of it"),
        ("signal.block", "since Python uses a word of it"),
        ("signal.derivative", "is in the standard library"),
    ],
)
def test_a_name_that_no_block_can_have_is_refused(name: str, reason: str, project: Path) -> None:
    with pytest.raises(QuadvisError, match=reason):
        new_block(name)
    assert list(project.iterdir()) == []


@pytest.mark.parametrize("name", ["loop", "loop.txt", ".yaml", "a: b.yaml", "loop#1.yaml", ""])
def test_a_name_that_no_diagram_can_have_is_refused(name: str, project: Path) -> None:
    with pytest.raises(QuadvisError, match=r"is not a YAML file|cannot name a diagram"):
        new_diagram(name)
    assert list(project.iterdir()) == []


def test_nothing_is_written_over(project: Path) -> None:
    Path("loop.yaml").write_text("mine")
    with pytest.raises(QuadvisError, match=r"'loop\.yaml' is there already"):
        new_diagram("loop.yaml")
    assert Path("loop.yaml").read_text() == "mine"
    test = Path("tests/blocks/signal/test_my_filter.py")
    test.parent.mkdir(parents=True)
    test.write_text("mine")
    with pytest.raises(QuadvisError, match="is there already"):
        new_block("signal.my_filter")
    assert not Path("blocks").exists()


def test_a_place_that_cannot_be_written_is_a_sentence(project: Path) -> None:
    Path("blocks").write_text("a file in the way")
    with pytest.raises(QuadvisError, match=r"cannot write 'blocks/signal/my_filter\.py'"):
        new_block("signal.my_filter")


def test_a_new_project_meets_what_it_expects_in_the_house_style(project: Path) -> None:
    paths = new_project("tank")
    assert Path("tank/tank.yaml") in paths and all(path.is_file() for path in paths)
    assert not any("{" in path.name for path in paths)
    assert load("tank/tank.yaml").run().passed
    for path in paths:
        if path.suffix == ".yaml":
            text = path.read_text()
            assert formatted(text, str(path), key_ranks) == text
    ruff = [sys.executable, "-m", "ruff", "check", "--select", "E,F,I,UP", "--line-length", "100", "tank"]
    done = subprocess.run(ruff, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout


@pytest.mark.slow
def test_the_tests_of_a_new_project_pass(project: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    new_project("some/tank_2")
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q"], cwd="some/tank_2", capture_output=True, text=True
    )
    assert (done.returncode, "5 passed" in done.stdout) == (0, True), done.stdout


@pytest.mark.parametrize(
    ("name", "sentence"),
    [
        ("2nd", "'2nd' cannot name a project; use letters, digits and '_'"),
        ("my-loop", "'my-loop' cannot name a project"),
        ("class", "'class' cannot name a project"),
        ("there", "'there' is there already; choose another name, or remove it"),
    ],
)
def test_a_project_that_cannot_be_is_refused(name: str, sentence: str, project: Path) -> None:
    (project / "there").mkdir()
    with pytest.raises(QuadvisError, match=sentence):
        new_project(name)
    assert [path.name for path in project.iterdir()] == ["there"]
