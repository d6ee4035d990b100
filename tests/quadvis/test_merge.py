"""Three versions of a file merged by key, in words where both sides want something else; with git itself."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from quadvis.cli import main
from quadvis.diff.flat import flat_text
from quadvis.diff.merge import merge

BASE = """\
# A loop.
quadvis: 1
name: loop
params:
  wanted: 1 m  # metres

blocks:
  a:
    block: signal.gain
    with: {factor: 2, bias: 1}  # as tuned
    in: {u: b.y}
  # The ramp.
  b: {block: sources.ramp, rate: fast}

expect:
  - {signal: a.y, within: 3 m}
  - signal: b.y
    rms: 1 m
# The end.
"""


def changed(*pairs: tuple[str, str], text: str = BASE) -> str:
    for old, new in pairs:
        assert old in text
        text = text.replace(old, new, 1)
    return text


def both(ours: tuple[str, str], theirs: tuple[str, str]) -> Any:
    return merge(BASE, changed(ours), changed(theirs))


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (("factor: 2", "factor: 3"), ("bias: 1}", "bias: 4}")),  # two keys in one line
        (("1 m  # metres", "2 m  # metres"), ("name: loop", "name: ring")),
        (("factor: 2", "factor: 3"), ("in: {u: b.y}", "in: {u: c.y}")),
        (("within: 3 m", "within: 4 m"), ("a.y, within", "a.y, after: 1 s, within")),
        (("rms: 1 m", "rms: 2 m"), ("signal: b.y\n", "signal: b.y\n    after: 1 s\n")),
        (("  # The ramp.\n", "  # A ramp.\n"), ("factor: 2", "factor: 5")),
        (("# The end.", "# The very end."), ("# A loop.", "# A small loop.")),
        (("bias: 1}", "bias: 1, more: 2}"), ("factor: 2, ", "")),
        (
            ("    in: {u: b.y}\n", ""),
            ("  b: {block: sources.ramp, rate: fast}", "  b: {block: x.y, rate: fast}"),
        ),
    ],
)
def test_changes_at_different_keys_meet_in_one_file(ours: tuple[str, str], theirs: tuple[str, str]) -> None:
    """The result is what one person would have who made both changes."""
    expected = changed(ours, theirs) if theirs[0] in changed(ours) else changed(theirs, ours)
    assert both(ours, theirs) == (expected, ())
    assert both(theirs, ours) == (expected, ())


def test_blocks_that_both_add_at_one_place_both_stay() -> None:
    place = "  # The ramp.\n"
    found = both(
        (place, f"  c: {{block: x.y}}\n{place}"), (place, f"  # Theirs.\n  d:\n    block: x.z\n{place}")
    )
    assert not found.conflicts
    blocks = yaml.safe_load(found.text)["blocks"]
    assert list(blocks) == ["a", "d", "c", "b"] or list(blocks) == ["a", "c", "d", "b"]
    assert "  # Theirs.\n  d:\n" in found.text and "  # The ramp.\n  b:" in found.text


def test_expectations_that_both_add_both_stay() -> None:
    place = "# The end."
    found = both(
        (place, f"  - {{signal: x.y, rms: 1}}\n{place}"), (place, f"  - {{signal: z.y, rms: 1}}\n{place}")
    )
    assert not found.conflicts
    assert [each["signal"] for each in yaml.safe_load(found.text)["expect"]] == ["a.y", "b.y", "x.y", "z.y"]


def test_another_indentation_of_theirs_becomes_that_of_ours() -> None:
    theirs = changed(("  # The ramp.\n", "  c:\n    block: x.y\n  # The ramp.\n"))
    theirs = yaml.safe_dump(yaml.safe_load(theirs), indent=4, sort_keys=False)
    found = merge(
        BASE, changed(("  b: {block", "  d: {block: x.z}\n  b: {block"), ("factor: 2", "factor: 3")), theirs
    )
    assert not found.conflicts
    merged = yaml.safe_load(found.text)
    assert merged["blocks"]["c"] == {"block": "x.y"} and merged["blocks"]["d"] == {"block": "x.z"}
    assert merged["blocks"]["a"]["with"] == {"factor": 3, "bias": 1}


@pytest.mark.parametrize(
    ("ours", "theirs", "sentence"),
    [
        (("factor: 2", "factor: 3"), ("factor: 2", "factor: 4"),
         "blocks.a.with.factor is '3' in ours, '4' in theirs; it was '2'"),
        (("  b: {block: sources.ramp, rate: fast}\n", ""), ("rate: fast", "rate: slow"),
         "blocks.b is removed in ours, '{block: sources.ramp, rate: slow}' in theirs; "
         "it was '{block: sources.ramp, rate: fast}'"),
        (("rms: 1 m", "rms: 2 m"), ("rms: 1 m", "rms: 3 m"),
         "expect[1].rms is '2 m' in ours, '3 m' in theirs; it was '1 m'"),
        (("name: loop", "name: loop\nseed: 1"), ("name: loop", "name: loop\nseed: 2"),
         "seed is '1' in ours, '2' in theirs"),
    ],
)  # fmt: skip
def test_a_conflict_is_said_in_words(ours: tuple[str, str], theirs: tuple[str, str], sentence: str) -> None:
    found = both(ours, theirs)
    assert found.conflicts == (sentence,)
    lines = found.text.split("\n")
    marks = [lines.index(mark) for mark in ("<<<<<<< ours", "=======", ">>>>>>> theirs")]
    assert marks == sorted(marks)
    mine = lines[: marks[0]] + lines[marks[0] + 1 : marks[1]] + lines[marks[2] + 1 :]
    other = lines[: marks[0]] + lines[marks[1] + 1 : marks[2]] + lines[marks[2] + 1 :]
    assert yaml.safe_load("\n".join(mine)) == yaml.safe_load(changed(ours))
    assert yaml.safe_load("\n".join(other)) == yaml.safe_load(changed(theirs))


KEYS = st.sampled_from("abcd")
VALUES: Any = st.recursive(
    st.integers(0, 3),
    lambda inner: (
        st.lists(inner, min_size=1, max_size=3) | st.dictionaries(KEYS, inner, min_size=1, max_size=3)
    ),
    max_leaves=8,
)
FILES = st.tuples(st.dictionaries(KEYS, VALUES, min_size=1, max_size=4), st.sampled_from([False, None])).map(
    lambda pair: yaml.safe_dump(pair[0], default_flow_style=pair[1], sort_keys=False)
)


@given(FILES, FILES)
@settings(max_examples=25, deadline=None)
def test_what_one_side_alone_changed_is_taken_whole(base: str, other: str) -> None:
    for sides in ((base, other), (other, base), (other, other)):
        found = merge(base, *sides)
        assert not found.conflicts
        assert yaml.safe_load(found.text) == yaml.safe_load(other)


@given(FILES, FILES, FILES)
@settings(max_examples=30, deadline=None)
def test_a_merge_without_a_conflict_has_what_either_side_has(base: str, ours: str, theirs: str) -> None:
    found = merge(base, ours, theirs)
    old, mine, other = (yaml.safe_load(each) for each in (base, ours, theirs))
    if found.conflicts:
        assert "=======" in found.text
        return
    merged = yaml.safe_load(found.text)
    for key in {*old, *mine, *other}:
        if mine.get(key) == old.get(key):
            assert merged.get(key) == other.get(key)
        elif other.get(key) in (old.get(key), mine.get(key)):
            assert merged.get(key) == mine.get(key)
        else:
            assert key in merged


def test_a_file_has_a_line_for_each_value() -> None:
    lines = flat_text(BASE).splitlines()
    assert (
        "params.wanted: 1 m" in lines and "blocks.a.with.factor: 2" in lines and "expect[1].rms: 1 m" in lines
    )
    assert flat_text("a: [1, 2]\nb: {}\n") == "a: [1, 2]\nb: {}\n"
    assert flat_text("a: [1\n") == "a: [1\n"


def git(folder: Path, *words: str, check: bool = True) -> str:
    environment = {
        **os.environ, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull, "GIT_PAGER": "cat",
        "GIT_AUTHOR_NAME": "a", "GIT_AUTHOR_EMAIL": "a@b.c", "GIT_COMMITTER_NAME": "a",
        "GIT_COMMITTER_EMAIL": "a@b.c",
    }  # fmt: skip
    done = subprocess.run(
        ["git", *words], cwd=folder, env=environment, capture_output=True, text=True, check=check
    )
    return done.stdout + done.stderr


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with the three lines of diagrams/README.md, and a branch `theirs`."""
    quadvis = f"'{sys.executable}' -m quadvis"
    git(tmp_path, "init", "-q", "-b", "main")
    (tmp_path / ".gitattributes").write_text("*.yaml diff=quadvis merge=quadvis\n")
    git(tmp_path, "config", "diff.quadvis.textconv", f"{quadvis} diff --git")
    git(tmp_path, "config", "merge.quadvis.driver", f"{quadvis} merge %O %A %B")
    commit(tmp_path, BASE)
    git(tmp_path, "checkout", "-q", "-b", "theirs")
    return tmp_path


def commit(folder: Path, text: str) -> None:
    (folder / "loop.yaml").write_text(text)
    git(folder, "add", ".")
    git(folder, "commit", "-q", "-m", "A change")


@pytest.mark.slow
def test_git_merges_and_shows_by_key(repository: Path) -> None:
    commit(repository, changed(("factor: 2", "factor: 3"), ("rms: 1 m", "rms: 2 m")))
    git(repository, "checkout", "-q", "main")
    commit(repository, changed(("bias: 1}", "bias: 4}")))
    git(repository, "merge", "-q", "--no-edit", "theirs")
    merged = changed(("factor: 2, bias: 1", "factor: 3, bias: 4"), ("rms: 1 m", "rms: 2 m"))
    assert (repository / "loop.yaml").read_text() == merged
    shown = git(repository, "diff", "HEAD~1", "HEAD")
    assert "+expect[1].rms: 2 m" in shown and "+blocks.a.with.factor: 3" in shown


@pytest.mark.slow
def test_git_hands_a_conflict_on_in_words(repository: Path) -> None:
    commit(repository, changed(("factor: 2", "factor: 3")))
    git(repository, "checkout", "-q", "main")
    commit(repository, changed(("factor: 2", "factor: 4")))
    said = git(repository, "merge", "theirs", check=False)
    assert "blocks.a.with.factor is '4' in ours, '3' in theirs; it was '2'" in said
    assert "CONFLICT (content)" in said and "<<<<<<< ours" in (repository / "loop.yaml").read_text()
    assert git(repository, "status", "--short") == "UU loop.yaml\n"


def test_files_that_are_no_yaml_are_merged_by_lines(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    names = [str(tmp_path / name) for name in ("base", "ours", "theirs")]
    texts = ("a: [1\n\n\nb: 2\n", "a: [1\n\n\nb: 3\n", "a: [2\n\n\nb: 2\n")
    for name, text in zip(names, texts, strict=True):
        Path(name).write_text(text)
    assert main(["merge", *names]) == 0
    assert Path(names[1]).read_text() == "a: [2\n\n\nb: 3\n"
    assert "no YAML that can be merged by key" in capsys.readouterr().err
