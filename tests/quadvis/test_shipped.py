"""The files that come with quadvis, by names such as `quadvis:hover.yaml`, in a checkout and installed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

import quadvis
from quadvis.api import load_text
from quadvis.cli import main
from quadvis.errors import DiagramError
from quadvis.library.shipped_files import shipped_names
from quadvis.machine import shipped
from quadvis.machine.shipped import is_shipped, named_file, portable_name, shipped_folder

MUJOCO = find_spec("mujoco")
ROOT = Path(__file__).parents[2]
Captured = pytest.CaptureFixture[str]
OURS = """\
quadvis: 1
name: ours
rates: {vision: 10 Hz}
stop_time: 0.3 s
blocks:
  eyes:
    part: quadvis:parts/geometric_eyes.yaml
    rate: vision
    in: {position: {value: [0, 0, 1.5], unit: m}, attitude: {value: [0, 0, 0], unit: rad}}
  pose:
    block: vision.pose_n_points
    rate: vision
    with: {calibration: quadvis:calib/camera.yaml}
    in: {centres: eyes.centres}
"""


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("lab").mkdir()
    Path("lab/ours.yaml").write_text(OURS)
    Path("lab/hover.yaml").write_text("{quadvis: 1, name: hover, base: quadvis:hover.yaml}")
    return tmp_path


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """The folder of the diagrams where an installation has it."""
    folder = tmp_path / "site" / "quadvis" / "diagrams"
    shutil.copytree(ROOT / "diagrams", folder, ignore=shutil.ignore_patterns("pictures", "README.md"))
    monkeypatch.setattr(shipped, "INSTALLED", folder)
    shipped_folder.cache_clear()
    yield folder
    shipped_folder.cache_clear()


def test_in_a_checkout_they_are_where_they_are() -> None:
    assert shipped_folder() == ROOT / "diagrams"
    assert named_file("quadvis:parts/craft.yaml", "lab/x.yaml") == ROOT / "diagrams/parts/craft.yaml"
    assert named_file("parts/craft.yaml", "lab/x.yaml") == Path("lab/parts/craft.yaml")
    assert is_shipped(ROOT / "diagrams") and is_shipped(ROOT / "diagrams/x.yaml") and not is_shipped(ROOT)


def test_all_that_is_listed_is_there_and_nothing_is_left_out() -> None:
    names = shipped_names()
    assert all(named_file(name).is_file() for name in names)
    found = {path for kind in ("*.yaml", "*.xml") for path in (ROOT / "diagrams").rglob(kind)}
    assert {named_file(name) for name in names} == found


def test_a_part_a_calibration_and_a_base_are_found_from_any_folder() -> None:
    diagram = quadvis.load("lab/ours.yaml")
    assert set(diagram.listing) == {"eyes/mount", "eyes/camera", "pose"}
    assert {path.name for path in diagram.inputs} >= {"ours.yaml", "geometric_eyes.yaml", "camera.yaml"}


@pytest.mark.parametrize("variant", [None, "fused_geometric"])
def test_what_is_written_out_does_not_depend_on_the_place_of_quadvis(
    variant: str | None, installed: Path
) -> None:
    here = quadvis.load("lab/hover.yaml", variant=variant)
    assert f"{installed}" not in here.resolved and "quadvis:calib/camera.yaml" in here.resolved
    assert load_text(here.resolved, "lab").hash == here.hash
    shutil.move("lab", "laboratory")
    assert quadvis.load("laboratory/hover.yaml", variant=variant).hash == here.hash


def test_a_checkout_and_an_installation_give_one_hash(request: pytest.FixtureRequest) -> None:
    before = quadvis.load("lab/hover.yaml").hash
    request.getfixturevalue("installed")
    assert quadvis.load("lab/hover.yaml").hash == before


def test_in_the_folder_itself_paths_stay_relative() -> None:
    folder = shipped_folder()
    assert portable_name(folder / "calib/camera.yaml", folder) == "calib/camera.yaml"
    assert "quadvis:c" not in quadvis.load(folder / "hover.yaml").resolved


def test_nothing_is_written_into_an_installation(installed: Path) -> None:
    """The variant watch of the hover writes ../runs/hover.mp4."""
    for file, where in (("lab/hover.yaml", "lab/runs/hover.mp4"), ("quadvis:hover.yaml", "runs/hover.mp4")):
        diagram = quadvis.load(file, variant="watch")
        assert diagram.graph["eyes/video"].block.file == where


def test_in_a_checkout_the_shipped_diagrams_write_beside_their_folder() -> None:
    diagram = quadvis.load(shipped_folder() / "hover.yaml", variant="watch")
    assert Path(diagram.graph["eyes/video"].block.file).resolve() == ROOT / "runs" / "hover.mp4"


@pytest.mark.slow
def test_commands_and_parameter_files_take_them_by_name(installed: Path, capsys: Captured) -> None:
    Path("set.yaml").write_text(
        "{quadvis: 1, name: set, base: quadvis:sets/s1.yaml, set: {bandwidth: 1 rad/s}}"
    )
    for words in (
        ("check", "quadvis:hover.yaml"),
        ("check", "lab/hover.yaml", "--params", "quadvis:sets/s1.yaml"),
        ("check", "lab/hover.yaml", "--params", "set.yaml"),
        ("check", "lab/ours.yaml", "--set", "pose.calibration=quadvis:calib/camera.yaml"),
        ("draw", "quadvis:step.yaml"),
    ):
        assert main(words) == 0, capsys.readouterr().err
    assert Path("step.svg").is_file()


def test_a_name_that_is_not_there_gets_a_sentence(capsys: Captured) -> None:
    Path("lab/ours.yaml").write_text(OURS.replace("geometric_eyes", "geometric_eye"))
    with pytest.raises(DiagramError, match=r"no file 'quadvis:parts/geometric_eye\.yaml'; did you mean "):
        quadvis.load("lab/ours.yaml")
    assert main(["describe", "quadvis:parts/crft.yaml"]) == 2
    assert "did you mean 'quadvis:parts/craft.yaml'?" in capsys.readouterr().err


def test_they_are_listed_with_a_sentence_and_shown(capsys: Captured) -> None:
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("quadvis:parts/craft.yaml ") and "craft in the wind" in line for line in lines)
    assert main(["describe", "quadvis:parts/craft.yaml"]) == 0
    assert capsys.readouterr().out == (ROOT / "diagrams/parts/craft.yaml").read_text()


PLANT = '''"""A plant."""
from quadvis.block import Block, In, Out

class Ours(Block):
    """Stands where it is, whatever the rotors do; it gives what is read of a craft, and no more."""
    thrust = In("float64[4]", unit="N")
    position = Out("float64[3]", unit="m")
    attitude = Out("float64[3]", unit="rad")
    rates = Out("float64[3]", unit="rad/s")
    def output(self, thrust):
        return (0.0, 0.0, 1.5), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
'''
LAB = """\
quadvis: 1
name: lab
base: {file: quadvis:hover.yaml, variant: fused_geometric}
without: {blocks: [gust]}
blocks:
  craft: {block: plant.ours, rate: imu, in: {thrust: {from: radio.y, across: sample}}}
"""


def test_a_plant_of_ones_own_takes_the_place_of_the_craft(installed: Path) -> None:
    for name, text in {"blocks/plant/ours.py": PLANT, "diagrams/lab.yaml": LAB}.items():
        Path("lab", name).parent.mkdir(parents=True, exist_ok=True)
        Path("lab", name).write_text(text)
    result = quadvis.load("lab/diagrams/lab.yaml", stop_time="0.5 s").run()
    assert result["craft.position"][-1].tolist() == [0.0, 0.0, 1.5]
    assert len(result["control.thrust"]) == 11


@pytest.mark.slow
def test_a_wheel_has_all_that_its_diagrams_need(tmp_path: Path) -> None:
    """Build one, and fly its diagrams with nothing of this checkout on the path."""
    pip = [sys.executable, "-m", "pip", "wheel", "-q", "--no-deps", "-w", str(tmp_path), str(ROOT)]
    built = subprocess.run(pip, capture_output=True, text=True, check=False)
    if built.returncode and "No matching distribution found for hatchling" in built.stderr:
        pytest.skip("pip cannot fetch hatchling, which builds the wheel")
    assert built.returncode == 0, built.stderr
    site = tmp_path / "site"
    with zipfile.ZipFile(next(tmp_path.glob("quadvis-*.whl"))) as wheel:
        wheel.extractall(site)
    environment = {**os.environ, "PYTHONPATH": str(site)}
    for words in (
        ["check", "lab/hover.yaml"],
        ["run", "lab/ours.yaml", "--log", ""],
        ["run", "quadvis:step.yaml", "--stop-time", "0.2 s", "--log", ""],
        *(
            ["check", name]
            for name in shipped_names()
            if "/" not in name and (MUJOCO or "mujoco" not in name)
        ),
    ):
        command = [sys.executable, "-P", "-m", "quadvis", *words]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode in (0, 1 if words[0] == "run" else 0), done.stderr
        assert "Traceback" not in done.stderr
    where = "import quadvis, quadvis.machine.shipped as s; print(quadvis.__file__, s.shipped_folder())"
    shown = subprocess.run(
        [sys.executable, "-P", "-c", where], env=environment, capture_output=True, text=True, check=True
    )
    assert shown.stdout.split() == [str(site / "quadvis/__init__.py"), str(site / "quadvis/diagrams")]
