"""tools/constraints: the file of tried versions pins all that pyproject.toml asks for, and nothing else."""

import sys
import tomllib
from pathlib import Path

import pytest
from packaging.version import Version

from .script import loaded, run_script

ROOT = Path(__file__).parents[2]
TOOL = ROOT / "tools" / "constraints"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))


constraints = loaded(TOOL)
STATED = constraints.read((ROOT / "tools" / "constraints.txt").read_text("utf-8"))


@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="the versions were tried with Python 3.11")
def test_the_file_is_what_the_tool_would_write_here() -> None:
    found = run_script(TOOL, "--check")
    assert (found.returncode, found.stderr) == (0, "")


@pytest.mark.parametrize("name", sorted(constraints.declared(PROJECT)))
def test_what_pyproject_asks_for_is_pinned_within_its_bounds(name: str) -> None:
    assert constraints.declared(PROJECT)[name].specifier.contains(STATED[name])


@pytest.mark.parametrize("name", sorted(constraints.declared(PROJECT)))
def test_every_dependency_has_a_lower_bound_that_can_be_tried(name: str) -> None:
    assert Version(constraints.lowest(PROJECT)[name]) <= Version(STATED[name])


def test_what_others_need_is_pinned_too() -> None:
    assert {"scipy", "llvmlite", "kiwisolver", "ruamel-yaml", "hatchling"} <= STATED.keys()


def test_there_is_no_path_no_address_and_no_hash_in_the_file() -> None:
    lines = (ROOT / "tools" / "constraints.txt").read_text("utf-8").splitlines()[1:]
    assert not [line for line in lines if any(mark in line for mark in ("/", "@", "--", "sha256", "\\"))]


@pytest.mark.parametrize(
    "line",
    [
        "numpy", "numpy>=2.2", "numpy==2.2 ; python_version>'3'", "numpy == 2.2", "Numpy==2.2", "-e .",
        "numpy @ https://example.org/numpy.whl", "ruamel.yaml==0.19", "numpy==", "numpy==2.2 --hash=sha256:0",
        "numpy==2.2\nnumpy==2.3",
    ],
)  # fmt: skip
def test_a_line_of_another_form_is_refused(line: str) -> None:
    with pytest.raises(ValueError, match=r"is not 'name==version'|stands there twice"):
        constraints.read(line)


def test_names_that_lack_or_are_too_many_and_other_versions_are_all_reported() -> None:
    found = constraints.differences({"a": "1", "b": "1", "c": "1"}, {"a": "1", "b": "2", "d": "1"})
    assert [line.partition(":")[0] for line in found] == ["b", "c", "d"]


def test_the_readme_s_two_commands_use_the_file() -> None:
    commands = [
        line for line in (ROOT / "README.md").read_text("utf-8").splitlines() if "pip install" in line
    ]
    assert len(commands) == 2
    assert all("pip install -q -c tools/constraints.txt -e" in line for line in commands)
