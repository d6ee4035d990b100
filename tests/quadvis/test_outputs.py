"""No output of a command or block replaces an input, another kind of file, or another program's output."""

from __future__ import annotations

import hashlib
import os
import pty
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from itertools import product
from pathlib import Path

import cv2
import numpy as np
import pytest

import quadvis
from quadvis.cli import main
from quadvis.errors import DiagramError, QuadvisError
from quadvis.machine.files import LOG, Claim, Kind, file_name, open_output, reading, write_output
from quadvis.machine.interrupts import ENDS
from quadvis.output.log_reader import read_log
from tests.stages import mostly_slow

LOOP = """\
quadvis: 1
name: {name}
rates: {{fast: 100 Hz}}
stop_time: 1 s
blocks:
  inner: {{part: part.yaml, rate: fast}}
  law: {{slot: true, block: signal.gain, rate: fast, in: {{u: inner.y}}}}
variants:
  c: {{slots: {{law: {{block: signal.gain, with: {{factor: 0.5}}}}}}}}
  b: {{slots: {{law: {{block: signal.gain, with: {{factor: 0.25}}}}}}}}
"""
PART = """\
quadvis: 1
name: part
ports: {out: {y: wave.y}}
blocks:
  wave: {block: sources.sine}
"""
PLAYED = """\
quadvis: 1
name: played
rates: {fast: 10 Hz}
stop_time: 0.3 s
blocks:
  player: {block: vision.image_folder, rate: fast, with: {folder: pictures}}
"""
WRITER = "  {name}: {{block: vision.{kind}, rate: fast, with: {{{what}}}, in: {{frame: player.frame}}}}\n"
INPUTS = ["loop.yaml", "part.yaml", "set.yaml", "base.yaml"]

Captured = pytest.CaptureFixture[str]
OWN = "own blocks from 'blocks'\n"  # what a run says before the diagram's own code is run


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    before = {number: signal.getsignal(number) for number in ENDS}
    monkeypatch.chdir(tmp_path)
    Path("loop.yaml").write_text(LOOP.format(name="loop"))
    Path("part.yaml").write_text(PART)
    Path("base.yaml").write_text("quadvis: 1\nname: base\nset: {law.factor: 2}\n")
    Path("set.yaml").write_text("quadvis: 1\nname: set\nbase: base.yaml\nset: {law.factor: 3}\n")
    Path("pictures").mkdir()
    for number in (1, 2):
        cv2.imwrite(f"pictures/00000{number}.png", np.full((20, 24, 3), 40 * number, np.uint8))
    yield tmp_path
    for number, handler in before.items():
        signal.signal(number, handler)


def contents(folder: Path) -> dict[str, str]:
    """Return what every file holds."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file())
    return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def named(source: str, how: str, target: str) -> str:
    """Give a file another name, in every possible way."""
    Path(target).parent.mkdir(exist_ok=True, parents=True)
    match how:
        case "spelling":
            return f"pictures/../{source}"
        case "symbolic":
            Path(target).symlink_to(Path(source).absolute())
        case "hard":
            Path(target).hardlink_to(source)
    return source if how == "same" else target


# commands


# A drawing takes half a second, also one that is refused.
@pytest.mark.parametrize(
    ("command", "how"),
    mostly_slow(list(product(["run --log", "draw -o"], ["same", "spelling", "symbolic", "hard"])), 5),
)
@pytest.mark.parametrize("source", INPUTS)
def test_no_command_writes_over_what_it_reads(
    command: str, source: str, how: str, project: Path, capsys: Captured
) -> None:
    name, option = command.split()
    output = named(source, how, "other")
    before = contents(project)
    assert main([name, "loop.yaml", "--params", "set.yaml", option, output]) == 2
    told = capsys.readouterr()
    assert (told.out, told.err.count("\n")) == ("", 1)
    assert "is an input" in told.err
    assert contents(project) == before


CONTENTS = [b"notes\n", b"quadvis: 1\n", b"\x89HDF\r\n", b"%PDF-1.4", b"[1]"]


@pytest.mark.parametrize(
    ("command", "content"),
    mostly_slow(list(product(["run loop.yaml --log", "schema -o", "draw loop.yaml -o"], CONTENTS)), 11),
)
def test_a_file_of_another_kind_stays(command: str, content: bytes, project: Path, capsys: Captured) -> None:
    Path("out").write_bytes(content)
    before = contents(project)
    assert main([*command.split(), "out"]) == 2
    assert "a file of another kind is there" in capsys.readouterr().err
    assert contents(project) == before


@pytest.mark.slow
def test_every_command_writes_again_what_it_wrote(project: Path) -> None:
    for _ in range(2):
        assert main(["run", "loop.yaml", "--log", "x.mcap"]) == 0
        assert main(["plot", "x.mcap", "-o", "figures"]) == 0
        assert main(["draw", "loop.yaml"]) == 0
        assert main(["schema", "-o", "schema.json"]) == 0
        assert main(["sweep", "loop.yaml", "--over", "seed=0", "--workers", "1", "--logs", "logs"]) == 0
    assert read_log("x.mcap").complete
    assert not list(Path().glob("**/.*"))
    assert list(Path().glob("**/*-sweep.csv")) and not list(
        Path().glob("**/*-sweep.png")
    )  # it has no numbers


@pytest.mark.parametrize("how", ["same", "symbolic", "hard"])
def test_a_figure_never_takes_the_place_of_the_log_or_of_something_else(
    how: str, project: Path, capsys: Captured
) -> None:
    assert main(["run", "loop.yaml", "--log", "x.mcap"]) == 0
    assert main(["plot", "x.mcap", "-o", "figures"]) == 0
    figure = min(Path("figures").iterdir())
    figure.unlink()
    if how == "same":
        figure.write_text("notes")
    else:
        named("x.mcap", how, str(figure))
    before = contents(project)
    capsys.readouterr()
    assert main(["plot", "x.mcap", "-o", "figures"]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert contents(project) == before


def test_a_skeleton_replaces_nothing(project: Path, capsys: Captured) -> None:
    before = contents(project)
    assert main(["new", "diagram", "loop.yaml"]) == 2
    assert contents(project) == before


def test_a_log_may_be_none(project: Path) -> None:
    before = contents(project)
    assert main(["run", "loop.yaml", "--log", ""]) == 0
    assert contents(project) == before


# writers in a diagram


def diagram(*writers: tuple[str, str, str]) -> str:
    """Return a diagram that plays pictures, with writers (name, kind, parameters)."""
    text = PLAYED + "".join(WRITER.format(name=n, kind=k, what=w) for n, k, w in writers)
    Path("played.yaml").write_text(text)
    return "played.yaml"


@pytest.mark.parametrize(
    ("writers", "words"),
    [
        ([("w", "frame_writer", "folder: pictures")], "the folder that block 'player' reads"),
        ([("w", "frame_writer", "folder: ./pictures/")], "the folder that block 'player' reads"),
        ([("w", "frame_writer", "folder: link")], "the folder that block 'player' reads"),
        ([("w", "video_writer", "file: own.mkv")], "is an input ('played.yaml')"),
        ([("w", "video_writer", "file: soft.mkv")], "is an input ('pictures/000001.png')"),
        ([("w", "video_writer", "file: hard.avi")], "is an input ('pictures/000001.png')"),
        (
            [("v", "video_writer", "file: x.mkv"), ("w", "video_writer", "file: x.mkv")],
            "what block 'v' writes",
        ),
        (
            [("v", "video_writer", "file: x.avi"), ("w", "video_writer", "file: ./pictures/../x.avi")],
            "block 'v'",
        ),
        ([("v", "frame_writer", "folder: a"), ("w", "frame_writer", "folder: a")], "what block 'v' writes"),
        ([("v", "frame_writer", "folder: a"), ("w", "frame_writer", "folder: a, format: jpg")], "block 'v'"),
    ],
)
def test_check_tells_the_writer_that_would_destroy_something(
    writers: list[tuple[str, str, str]], words: str, project: Path, capsys: Captured
) -> None:
    file = diagram(*writers)
    Path("link").symlink_to("pictures")
    Path("own.mkv").symlink_to("played.yaml")
    Path("soft.mkv").symlink_to("pictures/000001.png")
    Path("hard.avi").hardlink_to("pictures/000001.png")
    before = contents(project)
    for command in ("check", "run"):
        assert main([command, file]) == 2
        told = capsys.readouterr().err
        assert told.count("\n") == 1
        assert told.startswith("played.yaml:")
        assert "block 'w'" in told
        assert words in told
    assert contents(project) == before


def test_a_calibration_is_no_video(project: Path, capsys: Captured) -> None:
    file = diagram(("w", "video_writer", "file: x.mkv"))
    Path("x.mkv").write_text("size: [640, 480]\n")
    before = contents(project)
    assert main(["run", file, "--log", ""]) == 2
    assert "a file of another kind is there" in capsys.readouterr().err
    assert contents(project) == before


@pytest.mark.parametrize("log", ["x.mkv", "./pictures/../x.mkv"])
def test_a_log_never_goes_where_a_block_writes(log: str, project: Path, capsys: Captured) -> None:
    file = diagram(("w", "video_writer", "file: x.mkv"))
    before = contents(project)
    assert main(["run", file, "--log", log]) == 2
    assert "a block of the diagram writes that" in capsys.readouterr().err
    assert contents(project) == before


def test_writers_with_places_of_their_own_run_again_and_again(project: Path) -> None:
    file = diagram(("v", "video_writer", "file: x.mkv"), ("w", "frame_writer", "folder: out"))
    first = quadvis.load(file)
    for _ in range(2):
        assert main(["run", file, "--log", "x.mcap"]) == 0
    assert quadvis.load(file).hash == first.hash  # what is written is no part of it
    assert sorted(path.name for path in Path("out").iterdir()) == ["000001.png", "000002.png"]


def test_a_picture_that_is_read_is_kept_also_from_a_writer_into_another_folder(
    project: Path, capsys: Captured
) -> None:
    file = diagram(("w", "frame_writer", "folder: out"))
    Path("out").mkdir()
    Path("out/000002.png").hardlink_to("pictures/000001.png")
    before = contents(project)
    assert main(["run", file, "--log", ""]) == 2
    assert "is an input" in capsys.readouterr().err
    assert contents(project) == before


def test_a_diagram_knows_its_inputs(project: Path) -> None:
    found = {Path(path).resolve() for path in quadvis.load("loop.yaml", params="set.yaml").inputs}
    assert found >= {Path(name).resolve() for name in INPUTS}
    played = quadvis.load(diagram(("w", "frame_writer", "folder: out"))).inputs
    assert [path.name for path in played if path.suffix == ".png"] == ["000001.png", "000002.png"]
    assert Path("out") not in played


def test_what_is_read_is_kept_from_whoever_writes(project: Path) -> None:
    with reading(["loop.yaml", "pictures"]):
        for path in ("loop.yaml", "pictures/000002.png"):
            with pytest.raises(QuadvisError, match="is an input"):
                write_output(path, Kind("the notes"), "x")
        with reading(["part.yaml"]), pytest.raises(QuadvisError, match="is an input"):
            open_output("part.yaml", Kind("the notes"))
    write_output("part.yaml", Kind("the notes"), "x")


# names


NAMES = [
    ("a-b", "c"),
    ("a", "b"),
    ("a-b", None),
    ("a-b-c", None),
    ("a b", "c"),
    ("a/b-c", None),
    ("a:b", "c"),
    ("ä b", "c"),
    ("ö b", "c"),
    ("x" * 150, "c"),
    ("x" * 151, "c"),
    ("...", None),
    ("../..", None),
]


def test_default_names_of_logs_never_meet(project: Path, capsys: Captured) -> None:
    found = {}
    for number, (name, variant) in enumerate(NAMES):
        file = f"{number}.yaml"
        Path(file).write_text(LOOP.format(name=f"'{name}'"))
        for _ in range(2):  # the second run has the name of the first one
            assert main(["run", file, *(["--variant", variant] if variant else [])]) == 0
            log = capsys.readouterr().out.splitlines()[-1].removeprefix("log: ")
            assert found.setdefault(number, log) == log
    assert len(set(found.values())) == len(NAMES)
    assert {str(path) for path in Path("runs").iterdir()} == set(found.values())
    for number, log in found.items():
        facts = read_log(log).metadata
        assert (facts["name"], facts["variant"]) == (NAMES[number][0], NAMES[number][1] or "")
    assert found[0] == "runs/a-b-c.mcap"


def test_parameter_sets_and_variants_of_one_name_have_logs_of_their_own(project: Path) -> None:
    Path("c.yaml").write_text("quadvis: 1\nname: c\nset: {law.factor: 7}\n")
    assert main(["run", "loop.yaml", "--params", "c.yaml"]) == 0
    assert main(["run", "loop.yaml", "--variant", "c"]) == 0
    assert len(list(Path("runs").iterdir())) == 2


@pytest.mark.slow
def test_drawings_and_tables_of_variants_have_names_of_their_own(project: Path, capsys: Captured) -> None:
    outputs = set()
    for options in ([], ["--variant", "c"], ["--variant", "b"], ["--params", "set.yaml"]):
        assert main(["draw", "loop.yaml", *options]) == 0
        outputs.add(capsys.readouterr().out)
    assert len(outputs) == 4
    assert "loop.svg\n" in outputs


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (("a b",), ("a-b",)),
        (("a", "b"), ("a-b",)),
        (("a", "b"), ("a+b",)),
        (("a", "b"), ("a,b",)),
        (("é",), ("è",)),
        (("a/",), ("a",)),
        ((".a",), ("a",)),
        (("",), ("-",)),
        (("x" * 300,), ("x" * 301,)),
        (("\ud800",), ("\ud801",)),
    ],
)
def test_other_names_give_other_files(one: tuple[str, ...], other: tuple[str, ...]) -> None:
    assert file_name(*one) != file_name(*other)
    for name in (file_name(*one), file_name(*other)):
        assert 0 < len(name) < 120
        assert not set(name) & set("/\\:\0 ")


# several processes

SLOW = """\
import time
from pathlib import Path
from quadvis.block import Block, In


class Slow(Block, numeric=False):
    \"""Waits until a file is there.\"""

    u = In(unit="a")

    def update(self, u):
        \"""Wait.\"""
        Path("begun").touch()
        while not Path("go on").exists():
            time.sleep(0.02)
"""


def slow_loop() -> None:
    Path("blocks/own").mkdir(parents=True)
    Path("blocks/own/slow.py").write_text(SLOW)
    slow = "  slow: {block: own.slow, rate: fast, in: {u: law.y}}\nvariants:"
    Path("slow.yaml").write_text(LOOP.format(name="slow").replace("variants:", slow))


def started(*arguments: str, **options: object) -> subprocess.Popen[str]:
    return subprocess.Popen(  # type: ignore[call-overload, no-any-return]
        [sys.executable, "-m", "quadvis", *arguments],
        stdout=options.pop("stdout", subprocess.PIPE), stderr=options.pop("stderr", subprocess.PIPE),
        text=True, **options,
    )  # fmt: skip


def wait_for(path: str) -> None:
    end = time.monotonic() + 120
    while not Path(path).exists():
        assert time.monotonic() < end
        time.sleep(0.02)


@pytest.mark.parametrize("log", mostly_slow([((),), (("--log", "x.mcap"),)]))
def test_two_runs_at_a_time_end_with_one_whole_log_and_one_refusal(
    log: tuple[str, ...], capsys: Captured
) -> None:
    slow_loop()
    first = started("run", "slow.yaml", *log)
    wait_for("begun")
    assert main(["run", "slow.yaml", *log]) == 2
    assert capsys.readouterr().err.endswith("another run is writing it; choose another name\n")
    Path("go on").touch()
    _, told = first.communicate(timeout=120)
    assert (first.returncode, told) == (0, OWN)
    whole = read_log(log[1] if log else "runs/slow.mcap")
    assert whole.complete
    assert len(whole["law.y"]) == 101


@pytest.mark.slow
def test_runs_of_variants_side_by_side_end_with_a_whole_log_each(project: Path) -> None:
    for number, name in enumerate(("a-b", "a")):
        Path(f"{number}.yaml").write_text(LOOP.format(name=name))
    runs = [
        started("run", f"{number}.yaml", "--stop-time", "20 s", *(["--variant", variant] if variant else []))
        for number, variant in ((0, None), (1, "b"))
    ]
    for run in runs:
        _, told = run.communicate(timeout=120)
        assert (run.returncode, told) == (0, "")
    logs = [read_log(path) for path in Path("runs").iterdir()]
    assert sorted(log.metadata["name"] for log in logs) == ["a", "a-b"]
    assert all(log.complete and len(log["law.y"]) == 2001 for log in logs)


def test_a_claim_is_refused_to_others_until_it_is_closed(project: Path) -> None:
    claim = Claim("x", LOG)
    for _ in range(3):
        with pytest.raises(QuadvisError, match="another run is writing it"):
            Claim("x", LOG)
        claim.write(LOG.heads[0])
        claim.append(b"more")
    assert Path("x").read_bytes() == LOG.heads[0] + b"more"
    claim.close()
    Claim("x", LOG).close()
    assert Path("x").read_bytes() == LOG.heads[0] + b"more"
    Claim("y", LOG).close()
    assert not Path("y").exists()


# signals


def recording() -> str:
    """Return a diagram that waits while it writes a video."""
    slow_loop()
    text = PLAYED.replace("stop_time: 0.3 s", "stop_time: 1000 s") + (
        "  film: {block: vision.video_writer, rate: fast, with: {file: x.mkv}, in: {frame: player.frame}}\n"
        "  waits: {block: own.slow, rate: fast, in: {u: clock.y}}\n"
        "  clock: {block: sources.sine, rate: fast}\n"
    )
    Path("film.yaml").write_text(text)
    return "film.yaml"


def whole_log_and_video() -> bool:
    video = cv2.VideoCapture("x.mkv")
    return read_log("x.mcap").complete and bool(video.read()[0])


@pytest.mark.parametrize(("number", "code"), mostly_slow([(signal.SIGHUP, 129), (signal.SIGTERM, 143)]))
def test_a_run_that_is_ended_closes_its_log_and_its_video(number: signal.Signals, code: int) -> None:
    process = started("run", recording(), "--log", "x.mcap")
    wait_for("x.mcap")
    wait_for("begun")
    for _ in range(3):  # terminals and shells send more than one
        process.send_signal(number)
    out, told = process.communicate(timeout=120)
    assert (process.returncode, out, told) == (code, "", OWN)
    assert whole_log_and_video()


def test_a_run_whose_terminal_is_closed_closes_its_log_and_its_video() -> None:
    file = recording()
    child, terminal = pty.fork()
    if child == 0:
        os.execv(sys.executable, [sys.executable, "-m", "quadvis", "run", file, "--log", "x.mcap"])
    wait_for("begun")
    os.close(terminal)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 129
    assert whole_log_and_video()


def test_nohup_is_respected() -> None:
    file = recording()
    script = f"trap '' HUP; exec {sys.executable} -m quadvis run {file} --log x.mcap --stop-time '1 s'"
    process = subprocess.Popen(
        ["sh", "-c", script], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    wait_for("begun")
    process.send_signal(signal.SIGHUP)
    Path("go on").touch()
    _, told = process.communicate(timeout=120)
    assert (process.returncode, told) == (0, OWN)
    assert whole_log_and_video()


def test_faults_of_writers_stand_beside_other_faults(project: Path) -> None:
    file = diagram(("w", "frame_writer", "folder: pictures"), ("v", "frame_writer", "folder: a, every: 0"))
    with pytest.raises(DiagramError) as caught:
        quadvis.load(file)
    assert len(caught.value.faults) == 2
