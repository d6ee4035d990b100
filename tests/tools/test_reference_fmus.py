"""The program that runs the Reference FMUs, on a checkout that is made of FMUs of our own."""

from __future__ import annotations

import shutil
from pathlib import Path

from tests.fmus import models
from tests.fmus.builder import Model, fmu, needs_gcc

from .script import run_script

TOOL = Path(__file__).parents[2] / "tools" / "reference_fmus"
ROWS = "time,x\n0,1\n0.1,0.9\n0.2,{}\n"


def checkout(folder: Path, *made: tuple[Model, int]) -> Path:
    for name in ("BouncingBall", "Dahlquist"):
        (folder / name).mkdir()
        (folder / name / "config.h").touch()
    (folder / "Dahlquist" / "Dahlquist_out.csv").write_text(ROWS.format("0.81"))
    for model, version in made:
        (folder / "build-quadvis" / str(version) / "fmus").mkdir(parents=True, exist_ok=True)
        shutil.copy(
            fmu(model, version), folder / "build-quadvis" / str(version) / "fmus" / f"{model.name}.fmu"
        )
    return folder


@needs_gcc
def test_each_is_compared_with_its_reference_and_clocks_are_refused(tmp_path: Path) -> None:
    folder = checkout(tmp_path, (models.DAHLQUIST, 2), (models.DAHLQUIST, 3), (models.CLOCKS, 3))
    done = run_script(TOOL, folder, "--isolation", "none")
    assert done.returncode == 0, done
    lines = [line.split() for line in done.stdout.splitlines()]
    assert [line[:3] for line in lines[1:4]] == [
        ["Dahlquist", "2.0", "ok"], ["Clocks", "3.0", "ok"], ["Dahlquist", "3.0", "ok"]
    ]  # fmt: skip
    assert lines[4] == ["3", "of", "3", "as", "they", "should", "be"]
    (folder / "Dahlquist" / "Dahlquist_out.csv").write_text(ROWS.format("0.8"))
    done = run_script(TOOL, folder, "--isolation", "none")
    assert (done.returncode, done.stdout.count("FAILED")) == (1, 2)


def test_another_folder_is_refused(tmp_path: Path) -> None:
    done = run_script(TOOL, tmp_path)
    assert (done.returncode, done.stderr.strip()) == (
        2, f"reference_fmus: '{tmp_path}' is no checkout of Reference-FMUs"
    )  # fmt: skip
