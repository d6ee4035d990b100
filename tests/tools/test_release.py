"""tools/release: what it looks for in wheel and sdist; and that the papers of a release agree."""

from __future__ import annotations

import re
import sys
import tarfile
import tomllib
import zipfile
from io import BytesIO
from pathlib import Path

import pytest
import yaml

from quadvis.version import __version__

from .script import loaded, run_script

ROOT = Path(__file__).parents[2]
TOOL = ROOT / "tools" / "release"
release = loaded(TOOL)
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def wheel(folder: Path, names: list[str]) -> Path:
    path = folder / f"quadvis-{__version__}-py3-none-any.whl"
    with zipfile.ZipFile(path, "w") as archive:
        for name in names:
            archive.writestr(name, "")
    return path


def sdist(folder: Path, names: list[str]) -> Path:
    path = folder / f"quadvis-{__version__}.tar.gz"
    with tarfile.open(path, "w:gz") as archive:
        for name in names:
            archive.addfile(tarfile.TarInfo(f"quadvis-{__version__}/{name}"), BytesIO())
    return path


def test_what_is_whole_has_no_fault(tmp_path: Path) -> None:
    assert release.wheel_faults(wheel(tmp_path, list(release.WHEEL))) == []
    assert release.sdist_faults(sdist(tmp_path, list(release.SDIST))) == []


def test_what_is_missing_or_superfluous_is_named(tmp_path: Path) -> None:
    found = release.wheel_faults(
        wheel(tmp_path, [*release.WHEEL[1:], "tests/conftest.py", "a/__pycache__/b.pyc"])
    )
    assert [fault.partition(": ")[2] for fault in found] == [
        "quadvis/__main__.py is missing",
        "tests/conftest.py should not be there",
        "a/__pycache__/b.pyc should not be there",
    ]
    names = [name for name in release.SDIST if name != "NOTICE.md"]
    found = release.sdist_faults(sdist(tmp_path, [*names, ".venv/a.py"]))
    assert [fault.partition(": ")[2] for fault in found] == [
        "NOTICE.md is missing",
        ".venv/a.py should not be there",
    ]


def test_stages_may_be_named() -> None:
    parser = release.argparse.ArgumentParser()
    release.declare(parser)
    assert parser.parse_args([]).stages == [] and parser.parse_args(["check"]).stages == ["check"]
    found = run_script(TOOL, "upload")
    assert found.returncode == 2 and "there is no stage 'upload'; there are build, check, try" in found.stderr


def test_stages_need_what_is_built(tmp_path: Path) -> None:
    found = run_script(TOOL, "check", "-o", tmp_path)
    assert found.returncode == 1 and "is not there; run 'tools/release build' before" in found.stderr
    assert "Traceback" not in found.stderr
    assert run_script(TOOL, "chek").returncode == 2


def test_a_failed_command_shows_the_end_of_its_output() -> None:
    program = "for n in range(40): print('line', n)\nraise SystemExit(3)"
    with pytest.raises(release.RunError) as caught:
        release.call(sys.executable, "-c", program)
    assert "ends with exit code 3" in str(caught.value) and str(caught.value).endswith("line 39")
    assert "line 20" not in str(caught.value)


def test_this_python_is_found_and_an_unknown_one_is_not() -> None:
    assert release.interpreter("3.99") is None


def test_all_promised_versions_of_python_are_tried() -> None:
    promised = [line.rpartition(" ")[2] for line in PROJECT["classifiers"] if ":: Python ::" in line]
    assert tuple(promised) == release.PYTHONS
    assert PROJECT["requires-python"] == f">={promised[0]}"


def test_changes_and_citation_are_of_this_version() -> None:
    versions = re.findall(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.MULTILINE)
    assert versions[0] == __version__
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert (citation["version"], citation["cff-version"]) == (__version__, "1.2.0")
    paper = citation["references"][0]
    names = ", ".join(author["family-names"] for author in paper["authors"][:-1])
    assert (
        f"{names} and {paper['authors'][-1]['family-names']}, *{paper['title'].split(' control')[0]}"
        in " ".join((ROOT / "README.md").read_text("utf-8").split())
    )


def test_the_notice_names_the_works_that_come_along() -> None:
    rows = re.findall(
        r"^\| (\w+),.*?\| ([\d.]+) \| `(.*?)` \| (\S+)", (ROOT / "NOTICE.md").read_text("utf-8"), re.M
    )
    assert [name for name, *_ in rows] == ["elkjs", "uPlot"]
    for name, version, folder, licence in rows:
        text = (ROOT / folder / "README.md").read_text("utf-8")
        assert f"npm package `{name.lower()}` {version}," in text and licence in text
        assert any(Path(each).parent == Path(folder) for each in PROJECT["license-files"])
