"""The code in the folder `blocks` beside a diagram: it is said before it runs, and can be refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import quadvis
from quadvis.api import check, load_text
from quadvis.cli import main
from quadvis.errors import DiagramError
from tests.stages import mostly_slow

MARK = "import pathlib\npathlib.Path('ran').touch()\n"
FAN = '''"""A fan."""
from quadvis.block import Block, Out

class Fan(Block):
    """Turns."""
    y = Out(doc="speed")
    def output(self):
        return 1.0
'''
LOOP = """\
quadvis: 1
name: loop
rates: {fast: 10 Hz}
stop_time: 0.2 s
seed: 1
blocks:
  fan: {block: wind.fan, rate: fast}
  again: {block: wind.fan, rate: fast}
  gain: {block: signal.gain, rate: fast, in: {u: fan.y}}
"""
WRITES = """\
quadvis: 1
name: writes
rates: {{slow: 10 Hz}}
stop_time: 0.1 s
blocks:
  eye:
    block: vision.rendered_camera
    rate: slow
    with: {{calibration: {calibration}}}
    in: {{position: {{value: [0, 0, 1.5], unit: m}}, attitude: {{value: [0, 0, 0], unit: rad}}}}
  writer: {{block: vision.frame_writer, rate: slow, with: {{folder: {folder}}}, in: {{frame: eye.frame}}}}
"""
COMMANDS = [
    ("run", "mine/loop.yaml", "--log", ""),
    ("check", "mine/loop.yaml"),
    ("check", "mine/loop.yaml", "--json"),
    ("check", "mine/loop.yaml", "--variant", "half"),
    ("draw", "mine/loop.yaml", "-o", "-"),
    ("analyse", "mine/loop.yaml"),
    ("sweep", "mine/loop.yaml", "--over", "seed=0..1", "--workers", "2", "--plot", "", "-o", "table.csv"),
]
LIBRARY = [
    ("list",),
    ("list", "--json"),
    ("describe", "wind.fan"),
    ("describe", "wind.fan", "--json"),
    ("schema",),
]
Captured = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder from somebody else, with a block that writes a file when it is loaded."""
    block = tmp_path / "mine" / "blocks" / "wind" / "fan.py"
    block.parent.mkdir(parents=True)
    block.write_text(FAN + MARK)
    variant = "variants: {half: {slots: {gain: {block: signal.gain, with: {factor: 0.5}}}}}\n"
    text = LOOP.replace("gain: {block", "gain: {slot: true, block") + variant
    (tmp_path / "mine" / "loop.yaml").write_text(text)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_command_says_once_that_it_runs_the_blocks_beside_a_diagram(
    command: tuple[str, ...], capsys: Captured
) -> None:
    main(command)
    assert capsys.readouterr().err.count("own blocks from 'mine/blocks'\n") == 1
    assert Path("ran").exists()


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
def test_a_command_refuses_them_where_it_is_asked_to(command: tuple[str, ...], capsys: Captured) -> None:
    assert main([*command, "--no-own-blocks"]) == 2
    told = "".join(capsys.readouterr())
    assert "block 'wind.fan' is code of this diagram's own, in 'mine/blocks/wind/fan.py'" in told
    assert "own blocks from" not in told
    assert not Path("ran").exists()


@pytest.mark.parametrize("command", LIBRARY, ids=" ".join)
def test_what_shows_the_library_says_it_too_and_can_refuse(
    command: tuple[str, ...], capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir("mine")
    code = main([*command, "--no-own-blocks"])
    shown = capsys.readouterr()
    assert code == (2 if command[0] == "describe" else 0)
    assert "Turns." not in shown.out and "own blocks from" not in shown.err and not Path("ran").exists()
    assert main(command) == 0
    shown = capsys.readouterr()
    assert shown.err == "own blocks from 'blocks'\n"
    assert "Turns." in shown.out and Path("ran").exists()


@pytest.mark.parametrize("command", [("check", "mine/plain.yaml"), ("list",)], ids=" ".join)
def test_nothing_is_said_where_no_own_block_is_run(command: tuple[str, ...], capsys: Captured) -> None:
    Path("mine/plain.yaml").write_text(LOOP.replace("wind.fan", "sources.constant, with: {value: 1}"))
    assert main(command) == 0
    assert capsys.readouterr().err == ""
    assert not Path("ran").exists()


def test_it_is_said_before_the_code_runs_even_if_that_fails(capsys: Captured) -> None:
    Path("mine/blocks/wind/fan.py").write_text("import sys\nprint('running', file=sys.stderr)\n1 / 0\n")
    assert main(["check", "mine/loop.yaml"]) == 2
    told = capsys.readouterr().err
    assert told.startswith("own blocks from 'mine/blocks'\nrunning\n")
    assert "ZeroDivisionError" in told


def test_the_place_is_shown_without_control_characters(capsys: Captured) -> None:
    Path("mine").rename("mi\x1b[2Jne")
    assert main(["check", "mi\x1b[2Jne/loop.yaml"]) == 0
    assert capsys.readouterr().err == "own blocks from 'mi\\x1b[2Jne/blocks'\n"


def test_from_python_they_are_refused_or_reported_by_a_parameter() -> None:
    for refused in (
        lambda: quadvis.load("mine/loop.yaml", own_blocks=False),
        lambda: check("mine/loop.yaml", own_blocks=False),
        lambda: load_text(LOOP, "mine", own_blocks=False),
        lambda: quadvis.sweep("mine/loop.yaml", {"seed": range(2)}, own_blocks=False, workers=1),
    ):
        with pytest.raises(DiagramError, match=r"code of this diagram's own.*and such code is refused"):
            refused()
    assert not Path("ran").exists()
    folders: list[Path] = []
    diagram = quadvis.load("mine/loop.yaml", own_blocks=folders.append)
    assert set(folders) == {Path("mine/blocks")}
    assert diagram.own_blocks


def test_a_diagram_without_own_blocks_loads_where_they_are_refused() -> None:
    Path("mine/plain.yaml").write_text(LOOP.replace("wind.fan", "sources.constant, with: {value: 1}"))
    diagram = quadvis.load("mine/plain.yaml", own_blocks=False)
    assert not diagram.varied("gain.factor=2").own_blocks


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("1 / 0\n", "ZeroDivisionError"),
        ("def fan(:\n", "SyntaxError"),
        ("import no_such_module_anywhere\n", "ModuleNotFoundError"),
        ("", "must define one block"),
        (FAN.replace("def output(self)", "def output(self, u)"), "Fan.output asks for 'u'"),
    ],
)
@pytest.mark.parametrize("command", [("list",), ("list", "--json"), ("schema",)], ids=" ".join)
def test_a_broken_block_is_reported_and_the_rest_is_shown(
    command: tuple[str, ...], text: str, reason: str, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir("mine")
    Path("blocks/wind/fan.py").write_text(text)
    Path("blocks/wind/good.py").write_text(FAN.replace("Fan", "Good"))
    assert main(command) == 2
    shown = capsys.readouterr()
    assert "'wind.fan'" in shown.err and reason in shown.err
    assert "wind.good" in shown.out and "signal.gain" in shown.out and "wind.fan" not in shown.out
    if command != ("list",):
        json.loads(shown.out)


@pytest.mark.parametrize("folder", ["../out", "{there}/out"])
@pytest.mark.parametrize("command", ["check", "draw", "run"])
def test_only_a_run_writes_where_the_writers_of_a_foreign_diagram_say(
    command: str, folder: str, project: Path
) -> None:
    calibration = Path(__file__).parents[2] / "diagrams" / "calib" / "camera.yaml"
    Path("mine/writes.yaml").write_text(
        WRITES.format(calibration=calibration, folder=folder.format(there=project))
    )
    more = {"check": (), "draw": ("-o", "drawn.svg"), "run": ("--log", "")}[command]
    assert main([command, "mine/writes.yaml", *more]) == 0
    assert (project / "out").exists() == (command == "run")


# code that own blocks share, and a project with its blocks beside its diagrams

SHARES = '''"""A fan."""
from quadvis.block import Block, Out

from .._curves import LIFT
from .._motors.speeds import fast


class {name}(Block):
    """Turns."""
    y = Out(doc="speed")
    def output(self):
        return fast(LIFT)
'''
ONE = """\
quadvis: 1
name: one
rates: {fast: 10 Hz}
stop_time: 0.1 s
blocks:
  fan: {block: wind.fan, rate: fast}
"""


def sharing(folder: Path, lift: float = 2.0) -> Path:
    """Write a diagram whose blocks share modules, in their folder and in a package there; return its path."""
    blocks = folder / "blocks"
    for name in ("wind", "_motors"):
        (blocks / name).mkdir(parents=True, exist_ok=True)
    for name in ("Fan", "Big"):
        (blocks / "wind" / f"{name.lower()}.py").write_text(SHARES.replace("{name}", name))
    (blocks / "_curves.py").write_text(f"LIFT = {lift!r}\n")
    (blocks / "_motors" / "__init__.py").write_text("")
    (blocks / "_motors" / "speeds.py").write_text("def fast(lift):\n    return 10.0 * lift\n")
    (folder / "one.yaml").write_text(ONE + "  big: {block: wind.big, rate: fast}\n")
    return folder / "one.yaml"


@pytest.mark.parametrize("engine", mostly_slow(["python", "native"]))
def test_own_blocks_share_modules_of_their_folder_and_of_packages_there(project: Path, engine: str) -> None:
    result = quadvis.load(sharing(project)).run(engine=engine)
    assert result["fan.y"].tolist() == result["big.y"].tolist() == [20.0, 20.0]


def test_a_shared_module_that_was_edited_is_read_anew(project: Path) -> None:
    assert quadvis.load(sharing(project)).run()["fan.y"][0] == 20.0
    assert quadvis.load(sharing(project, lift=123.0)).run()["fan.y"][0] == 1230.0


def test_shared_modules_of_two_folders_do_not_meet(project: Path) -> None:
    ours, theirs = (quadvis.load(sharing(project / name, lift)) for name, lift in (("a", 2.0), ("b", 3.0)))
    assert (ours.run()["fan.y"][0], theirs.run()["fan.y"][0]) == (20.0, 30.0)
    assert quadvis.load(project / "a" / "one.yaml").run()["fan.y"][0] == 20.0


def test_shared_modules_are_inputs_and_no_blocks(project: Path, capsys: Captured) -> None:
    found = {path.name for path in quadvis.load(sharing(project)).inputs}
    assert {"one.yaml", "fan.py", "big.py", "_curves.py", "speeds.py"} <= found
    assert main(["list"]) == 0
    shown = capsys.readouterr().out
    assert "wind.big" in shown and "speeds" not in shown and "_curves" not in shown


def test_a_block_is_an_input_also_after_another_diagram_of_its_folder_was_loaded(project: Path) -> None:
    diagram = quadvis.load(sharing(project))
    (project / "two.yaml").write_text(ONE.replace("wind.fan", "wind.big"))
    quadvis.load("two.yaml")
    assert {"fan.py", "big.py"} <= {path.name for path in diagram.inputs}


@pytest.mark.parametrize("text", ["LIFT = 1 / 0\n", "LIFT = (\n"], ids=["error", "syntax"])
def test_an_error_in_a_shared_module_is_reported_at_its_line(project: Path, text: str) -> None:
    path = sharing(project)
    (project / "blocks" / "_curves.py").write_text(f"FIRST = 1\n{text}")
    with pytest.raises(DiagramError, match=r"block 'wind\.fan' cannot be loaded from blocks/_curves\.py:2: "):
        quadvis.load(path)


@pytest.fixture
def layout(project: Path) -> Path:
    """A project with folders `blocks` and `diagrams` side by side."""
    sharing(project / "lab")
    (project / "lab" / "diagrams").mkdir()
    (project / "lab" / "one.yaml").rename(project / "lab" / "diagrams" / "one.yaml")
    return project / "lab"


@pytest.mark.parametrize(
    ("here", "file", "said"),
    [
        ("", "lab/diagrams/one.yaml", "lab/blocks"),
        ("lab", "diagrams/one.yaml", "blocks"),
        ("lab/diagrams", "one.yaml", "../blocks"),
    ],
)
def test_blocks_beside_the_folder_of_the_diagrams_are_found_announced_and_refused(
    here: str, file: str, said: str, layout: Path, capsys: Captured, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(layout.parent / here)
    assert main(["check", file]) == 0
    assert capsys.readouterr().err == f"own blocks from '{said}'\n"
    assert main(["check", file, "--no-own-blocks"]) == 2
    told = capsys.readouterr().err
    assert f"block 'wind.fan' is code of this diagram's own, in '{said}/wind/fan.py'" in told
    assert "own blocks from" not in told


def test_blocks_beside_the_diagram_itself_come_first_and_other_folders_count_for_nothing(
    layout: Path,
) -> None:
    other = layout / "flights"
    other.mkdir()
    (other / "one.yaml").write_text(ONE)
    with pytest.raises(DiagramError, match=r"there is no block 'wind\.fan'"):
        quadvis.load(other / "one.yaml")
    (layout / "diagrams" / "blocks").mkdir()
    with pytest.raises(DiagramError, match=r"there is no block 'wind\.fan'"):
        quadvis.load(layout / "diagrams" / "one.yaml")


def test_a_base_brings_no_code(project: Path) -> None:
    (project / "ours.yaml").write_text("{quadvis: 1, name: ours, base: mine/loop.yaml}")
    with pytest.raises(
        DiagramError, match=r"mine/loop\.yaml:7:\d+: block 'fan': there is no block 'wind\.fan'"
    ):
        quadvis.load(project / "ours.yaml")
    assert not Path("ran").exists()
