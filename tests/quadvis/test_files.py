"""Outputs never destroy an input, a file of another kind, or what another process is writing."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from quadvis.errors import QuadvisError
from quadvis.machine.files import LOG, PNG, SVG, Kind, check_output, open_output, same_file, write_output

TEXT = Kind("the notes")
LOG_HEAD = LOG.heads[0]


@pytest.fixture
def here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def link(kind, source, target):
    """Give a file another name, in every possible way."""
    match kind:
        case "same":
            return source
        case "spelling":
            return Path(f"./folder/../{source}")
        case "symbolic":
            Path(target).symlink_to(source)
        case "hard":
            os.link(source, target)
    return Path(target)


@pytest.mark.parametrize("kind", ["same", "spelling", "symbolic", "hard"])
@pytest.mark.parametrize(
    "write", [check_output, open_output, lambda *args: write_output(*args[:2], b"x", args[2])]
)
def test_an_input_is_never_an_output(here, kind, write):
    (here / "folder").mkdir()
    source = Path("in.txt")
    source.write_bytes(b"precious")
    with pytest.raises(QuadvisError, match=r"it is an input.* and would be lost; choose another name"):
        write(link(kind, source, "other.txt"), TEXT, [source])
    assert source.read_bytes() == b"precious"


@pytest.mark.parametrize("kind", [LOG, PNG, SVG])
@pytest.mark.parametrize("content", [b"quadvis: 1\n", b"\xff\xd8\xff\xe0", b"\x89HDF\r\n", b"#!/bin/sh\n"])
def test_a_file_of_another_kind_stays(here, kind, content):
    Path("there").write_bytes(content)
    for write in (check_output, open_output):
        with pytest.raises(QuadvisError, match=r"cannot write .* 'there': a file of another kind is there"):
            write("there", kind)
    assert Path("there").read_bytes() == content


@pytest.mark.parametrize(
    ("kind", "old"),
    [(LOG, LOG_HEAD + b"1"), (PNG, b"\x89PNG\r\n\x1a\n"), (SVG, b"<svg/>"), (TEXT, b"old"), (LOG, b"")],
)
def test_a_file_of_the_same_kind_is_replaced(here, kind, old):
    Path("out").write_bytes(old)
    write_output("out", kind, b"new")
    assert Path("out").read_bytes() == b"new"
    Path("out").write_bytes(old)
    with open_output("out", kind) as file:
        file.write(b"newer")
    assert Path("out").read_bytes() == b"newer"
    assert sorted(os.listdir()) == ["out"]


def test_a_link_stays_a_link(here):
    Path("real").write_bytes(b"old")
    Path("name").symlink_to("real")
    write_output("name", TEXT, "new")
    assert Path("name").is_symlink()
    assert Path("real").read_bytes() == b"new"


def test_the_old_file_stays_if_the_new_one_cannot_be_written(here, monkeypatch):
    Path("out").write_bytes(b"old")

    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(QuadvisError, match="cannot write the notes 'out': no space left on device"):
        write_output("out", TEXT, b"new")
    assert Path("out").read_bytes() == b"old"
    assert os.listdir() == ["out"]


def test_places_that_are_no_files_are_refused_and_nothing_waits(here):
    os.mkfifo("pipe")
    Path("folder").mkdir()
    for path, why in [
        ("pipe", "a device or a pipe"),
        ("/dev/null", "a device or a pipe"),
        ("folder", "a folder"),
        ("none/x", "no folder 'none'"),
        ("a\0b", "no file can have this name"),
        ("x" * 300, "name too long"),
    ]:
        for write in (check_output, open_output):
            with pytest.raises(QuadvisError, match=why):
                write(path, TEXT)


def test_a_file_that_is_being_written_is_refused_also_to_another_process(here):
    other = "import sys; from quadvis.machine.files import *; open_output('log', LOG)"
    with open_output("log", LOG) as file:
        file.write(LOG_HEAD)
        file.flush()
        with pytest.raises(QuadvisError, match="another run is writing it"):
            open_output("log", LOG)
        done = subprocess.run([sys.executable, "-c", other], capture_output=True, text=True)
        assert "another run is writing it" in done.stderr
        assert Path("log").read_bytes() == LOG_HEAD
    open_output("log", LOG).close()


def test_the_lock_ends_with_the_process(here):
    other = "import os; from quadvis.machine.files import *; open_output('log', LOG); os.kill(os.getpid(), 9)"
    assert subprocess.run([sys.executable, "-c", other]).returncode == -9
    open_output("log", LOG).close()


def test_same_file_by_identity(here):
    Path("a").write_text("a")
    Path("b").write_text("a")
    os.link("a", "c")
    assert same_file("c", ["none", "b", "a"]) == Path("a")
    assert same_file("b", ["a", "c"]) is None
    assert same_file("none", ["none"]) is None


def test_a_kind_may_be_known_by_a_line(here):
    kind = Kind("the colours", pattern=rb"^circles:")
    for content, fits in [
        (b"# made today\ncircles:\n", True), (b"circles: 3", True), (b"", True),
        (b"quadvis: 1\n", False), (b"x: {circles: 3}", False), (b"# circles:", False),
    ]:  # fmt: skip
        Path("there").write_bytes(content)
        if fits:
            check_output("there", kind)
        else:
            with pytest.raises(QuadvisError, match="a file of another kind"):
                check_output("there", kind)


def test_permissions_stay_and_content_may_be_written_by_a_function(here):
    Path("out").write_bytes(b"old")
    os.chmod("out", 0o640)
    write_output("out", TEXT, lambda file: file.write(b"new"))
    assert (Path("out").read_bytes(), os.stat("out").st_mode & 0o777) == (b"new", 0o640)

    def fails(file):
        file.write(b"half")
        raise ValueError

    with pytest.raises(ValueError):
        write_output("out", TEXT, fails)
    assert (Path("out").read_bytes(), os.listdir()) == (b"new", ["out"])
