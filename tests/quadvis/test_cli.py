"""The command line: what it prints, what it leaves behind, and with which code it ends."""

from __future__ import annotations

import argparse
import json
import os
import re
import signal
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from importlib.metadata import version
from pathlib import Path
from typing import Any

import pytest

import quadvis
from quadvis.cli import main
from quadvis.cli.options import parser
from quadvis.output.log_reader import read_log

DIAGRAMS = Path(__file__).parents[2] / "diagrams"

LOOP = """\
quadvis: 1
name: a loop
rates: {fast: 100 Hz}
stop_time: 1 s
params: {size: 1 m}
blocks:
  wave: {block: sources.sine, rate: fast, with: {amplitude: $size}}
  law: {slot: true, block: signal.gain, rate: fast, in: {u: wave.y}}
variants:
  half: {slots: {law: {block: signal.gain, with: {factor: 0.5}}}}
expect:
  - {signal: law.y, within: 60 cm}
summary: {law: {signal: law.y, unit: cm}, later: {signal: law.y, after: 5 s}}
figures:
  - {title: Law, signals: [wave.y, law.y], unit: cm}
"""
FAULTY = LOOP.replace("sources.sine", "sources.sin").replace("law.y, within: 60 cm", "law.y, within: 60")

Captured = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def project(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    before = signal.getsignal(signal.SIGTERM)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "loop.yaml").write_text(LOOP)
    (tmp_path / "faulty.yaml").write_text(FAULTY)
    yield tmp_path
    signal.signal(signal.SIGTERM, before)


def done(*arguments: str) -> int:
    """Return the exit code of a command, argparse's own included."""
    try:
        return main(arguments)
    except SystemExit as error:
        return int(error.code or 0)


# run


def test_a_run_that_meets_its_expectations_ends_with_0(capsys: Captured) -> None:
    assert done("run", "loop.yaml", "--variant", "half") == 0
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "a loop (half): 1 s, seed 0"
    assert lines[-2:] == ["PASSED: 1 of 1 expectations met", "log: runs/a-loop-half.mcap"]
    assert read_log("runs/a-loop-half.mcap").complete


def test_a_run_that_does_not_ends_with_1(capsys: Captured) -> None:
    assert done("run", "loop.yaml", "--log", "") == 1
    out = capsys.readouterr().out
    assert "NOT MET  law.y within 60 cm  100 cm" in out
    assert out.splitlines()[-1] == "FAILED: 0 of 1 expectations met"
    assert not Path("runs").exists()


def test_settings_stop_time_and_seed_are_taken(capsys: Captured) -> None:
    assert (
        done(
            "run",
            "loop.yaml",
            "--set",
            "size=50 cm",
            "--stop-time",
            "0.5 s",
            "--seed",
            "9",
            "--log",
            "x.mcap",
        )
        == 0
    )
    assert capsys.readouterr().out.startswith("a loop: 0.5 s, seed 9\n")
    assert read_log("x.mcap").metadata["seed"] == "9"


def test_json_is_one_object_with_the_documented_keys(capsys: Captured) -> None:
    assert done("run", "loop.yaml", "--json", "--log", "") == 1
    out = capsys.readouterr().out
    facts = json.loads(out, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert out.count("\n") == 1
    assert facts["log"] is None
    assert facts["passed"] is False
    assert facts["summary"]["later"] == {"signal": "law.y", "unit": "m", "rms": None, "max": None}
    done("run", "--help")
    words = capsys.readouterr().out
    assert all(key in words for key in facts)
    assert all(key in words for key in facts["expect"][0])


def test_json_tells_where_the_log_is(capsys: Captured) -> None:
    done("run", "loop.yaml", "--json")
    assert json.loads(capsys.readouterr().out)["log"] == "runs/a-loop.mcap"


@pytest.mark.parametrize(
    "arguments",
    [
        ("run",),
        ("run", "none.yaml"),
        ("run", "."),
        ("run", "faulty.yaml"),
        ("run", "loop.yaml", "--variant", "none"),
        ("run", "loop.yaml", "--set", "size"),
        ("run", "loop.yaml", "--set", "sise=3 m"),
        ("run", "loop.yaml", "--set", "law.factor=3 m/x"),
        ("run", "loop.yaml", "--stop-time", "5"),
        ("run", "loop.yaml", "--stop-time", "-5 s"),
        ("run", "loop.yaml", "--seed", "one"),
        ("run", "loop.yaml", "--seed", "1" * 30),
        ("run", "loop.yaml", "--log", "none/run.mcap"),
        ("run", "loop.yaml", "--log", "."),
        ("run", "loop.yaml", "--unknown"),
        ("check", "faulty.yaml"),
        ("check", "faulty.yaml", "--json"),
        ("describe", "signal.derivativ"),
        ("describe", "-"),
        ("draw", "faulty.yaml"),
        ("draw", "loop.yaml", "-o", "none/x.svg"),
        ("plot", "none.mcap"),
        ("plot", "loop.yaml"),
        ("plot", "."),
        ("schema", "-o", "none/schema.json"),
        ("new", "block", "Filter"),
        ("new", "diagram", "loop.yaml"),
        ("new", "thing", "x"),
        ("fly", "loop.yaml"),
        (),
    ],
    ids=" ".join,
)
def test_bad_input_ends_with_2_and_a_sentence(
    arguments: tuple[str, ...], capsys: Captured, project: Path
) -> None:
    before = sorted(project.rglob("*"))
    assert done(*arguments) == 2
    captured = capsys.readouterr()
    assert "Traceback" not in captured.err
    assert captured.err.strip() or json.loads(captured.out)["ok"] is False
    drawn = [project / "faulty.svg"] if arguments == ("draw", "faulty.yaml") else []
    assert sorted(project.rglob("*")) == sorted([*before, *drawn])


def test_a_folder_that_cannot_be_made_for_the_log_is_a_sentence(capsys: Captured) -> None:
    Path("runs").write_text("a file in the way")
    assert done("run", "loop.yaml") == 2
    assert capsys.readouterr().err == (
        "cannot make the folder 'runs' for the log: file exists; name another place with --log\n"
    )


def test_the_name_of_a_diagram_cannot_lead_the_log_astray(project: Path) -> None:
    (project / "sly.yaml").write_text(LOOP.replace("name: a loop", "name: ../../sly"))
    done("run", "sly.yaml")
    assert [path.name for path in Path("runs").iterdir()] == ["sly.mcap"]
    assert not (project.parent / "sly.mcap").exists()


OWN = '''\
"""A block of the test."""

import os
import signal

from quadvis.block import Block, In, Out


class Own(Block, numeric=False):
    """Does what the test wants."""

    u = In(unit="a")
    y = Out(unit="a")

    def output(self, u, time):
        """Pass it on, until the time has come."""
        if time > 0.5:
            ACTION
        return u

    def close(self):
        """Leave a trace."""
        open("closed", "w").close()
'''


def own(project: Path, action: str) -> None:
    (project / "blocks" / "own").mkdir(parents=True)
    (project / "blocks" / "own" / "own.py").write_text(OWN.replace("ACTION", action))
    text = LOOP.replace("signal.gain, rate: fast, in", "own.own, rate: fast, in").replace(
        "stop_time: 1 s", "stop_time: 1000000 s"
    )
    (project / "own.yaml").write_text(text)


def test_a_block_that_fails_ends_the_run_with_1_and_tells_where_the_log_is(
    project: Path, capsys: Captured
) -> None:
    own(project, "raise ValueError('no good')")
    assert done("run", "own.yaml", "--engine", "python") == 1
    assert capsys.readouterr().err.splitlines() == [
        "own blocks from 'blocks'",
        "log up to there: runs/a-loop.mcap",
        "block 'law', t = 0.51 s: ValueError: no good in blocks/own/own.py:18",
    ]
    assert len(read_log("runs/a-loop.mcap")["wave.y"]) == 51
    assert Path("closed").exists()


def command(*arguments: str, **options: Any) -> subprocess.Popen[str]:
    """Start the command line as a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "quadvis", *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        **options,
    )


@pytest.mark.parametrize(
    ("number", "code", "words"), [(signal.SIGINT, 130, "interrupted\n"), (signal.SIGTERM, 143, "")]
)
def test_an_interrupted_run_leaves_its_log_and_closes_its_blocks(
    number: signal.Signals, code: int, words: str, project: Path
) -> None:
    own(project, f"os.kill(os.getpid(), {int(number)})")
    process = command("run", "own.yaml")
    try:
        out, err = process.communicate(timeout=60)
    finally:
        process.kill()  # one that does not listen would go on for ever, and fill the memory
    assert process.returncode == code
    assert out == ""
    assert "Traceback" not in err
    assert err.endswith(words)
    log = read_log("runs/a-loop.mcap")
    assert log.complete
    assert len(log["wave.y"]) >= 51
    assert Path("closed").exists()


def test_a_reader_that_goes_away_is_no_fault() -> None:
    reading, writing = os.pipe()
    os.close(reading)
    process = subprocess.Popen(
        [sys.executable, "-m", "quadvis", "list"], stdout=writing, stderr=subprocess.PIPE, text=True
    )
    os.close(writing)
    _, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (141, "")


def test_a_terminal_that_cannot_show_a_letter_gets_another(project: Path) -> None:
    text = LOOP.replace("a loop", "Höhe").replace("after: 5 s", "after: 1 s")
    (project / "loop.yaml").write_text(text, encoding="utf-8")
    process = command("run", "loop.yaml", "--log", "", env={**os.environ, "PYTHONIOENCODING": "ascii"})
    out, err = process.communicate(timeout=60)
    assert (process.returncode, err) == (1, "")
    assert out.startswith("H\\xf6he: 1 s")


# check


def test_a_right_diagram_is_told_in_one_line(capsys: Captured) -> None:
    assert done("check", "loop.yaml") == 0
    assert capsys.readouterr().out == "loop.yaml: 2 blocks in fast: no fault\n"
    assert done("check", "loop.yaml", "--variant", "half", "--set", "size=3 m", "--json") == 0
    facts = json.loads(capsys.readouterr().out)
    assert (facts["ok"], facts["diagram"], facts["blocks"], len(facts["hash"])) == (True, "a loop", 2, 64)


def test_all_faults_are_told_at_once(capsys: Captured) -> None:
    assert done("check", "faulty.yaml") == 2
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.splitlines() == [
        "faulty.yaml:7:17: block 'wave': there is no block 'sources.sin'; did you mean 'sources.sine'?",
    ]


def test_faults_are_told_as_json(capsys: Captured) -> None:
    assert done("check", "faulty.yaml", "--json") == 2
    assert json.loads(capsys.readouterr().out) == {
        "ok": False,
        "faults": [{
            "file": "faulty.yaml", "line": 7, "column": 17, "subject": "block 'wave'",
            "problem": "there is no block 'sources.sin'", "remedy": "did you mean 'sources.sine'?",
        }],
        "warnings": [],
    }  # fmt: skip


def test_faults_of_variants_are_told_without_naming_them(project: Path, capsys: Captured) -> None:
    (project / "loop.yaml").write_text(LOOP.replace("factor: 0.5", "fact: 0.5"))
    assert done("check", "loop.yaml") == 2
    assert "signal.gain has no parameter 'fact'; did you mean 'factor'?" in capsys.readouterr().err


# list, describe, draw, plot, schema, new


def test_all_blocks_are_listed(capsys: Captured) -> None:
    assert done("list") == 0
    lines = capsys.readouterr().out.splitlines()
    assert any(line.startswith("signal.derivative  ") for line in lines)
    assert done("list", "--json") == 0
    assert [entry["block"] for entry in json.loads(capsys.readouterr().out)] == [
        line.split()[0] for line in lines[: lines.index("")]
    ]


def test_own_blocks_are_listed_and_broken_ones_told(project: Path, capsys: Captured) -> None:
    own(project, "pass")
    (project / "blocks" / "own" / "broken.py").write_text("import nothing_like_it\n")
    assert done("list") == 2
    captured = capsys.readouterr()
    assert "own.own " in captured.out
    assert "own.broken" in captured.err


def test_a_block_is_described(capsys: Captured) -> None:
    assert done("describe", "signal.gain") == 0
    assert "factor  [*?] b/a  = 1  tunable  the factor" in capsys.readouterr().out
    assert done("describe", "signal.gain", "--json") == 0
    assert json.loads(capsys.readouterr().out)["params"]["factor"]["unit"] == "b/a"


def test_a_diagram_is_drawn(capsys: Captured) -> None:
    assert done("draw", "loop.yaml") == 0
    assert capsys.readouterr().out == "loop.svg\n"
    assert "wave" in "".join(ElementTree.parse("loop.svg").getroot().itertext())
    assert done("draw", "loop.yaml", "-o", "-") == 0
    assert capsys.readouterr().out == Path("loop.svg").read_text()


def test_a_log_is_plotted(capsys: Captured) -> None:
    done("run", "loop.yaml", "--log", "x.mcap")
    capsys.readouterr()
    assert done("plot", "x.mcap", "-o", "pictures") == 0
    assert capsys.readouterr().out == "pictures/1-law.png\n"
    assert Path("pictures/1-law.png").read_bytes()[:4] == b"\x89PNG"


def test_the_schema_is_json(capsys: Captured) -> None:
    assert done("schema") == 0
    schema = json.loads(capsys.readouterr().out)
    assert schema["$schema"].startswith("https://json-schema.org/draft/2020-12")
    assert done("schema", "-o", "schema.json") == 0
    assert json.loads(Path("schema.json").read_text()) == schema


def test_new_writes_and_tells_what_it_wrote(capsys: Captured) -> None:
    assert done("new", "block", "wind.fan") == 0
    assert capsys.readouterr().out.splitlines() == ["blocks/wind/fan.py", "tests/blocks/wind/test_fan.py"]
    assert done("new", "diagram", "more.yaml") == 0
    assert done("run", "more.yaml", "--log", "") == 0


def test_help_tells_every_command_and_what_it_does(capsys: Captured) -> None:
    (commands,) = [action for action in parser()._actions if isinstance(action, argparse._SubParsersAction)]
    assert len(commands.choices) >= 10
    assert done("--help") == 0
    shown = dict(re.findall(r"^    (\w+)(?: +|\n +)(\S.*)$", capsys.readouterr().out, re.MULTILINE))
    assert shown.keys() == commands.choices.keys()


@pytest.mark.parametrize("name", [name for action in parser()._actions for name in action.choices or ()])
def test_help_of_a_command_explains_every_option(name: str, capsys: Captured) -> None:
    assert done(name, "--help") == 0
    told = capsys.readouterr().out
    assert told.startswith(f"usage: quadvis {name} ")
    options = re.findall(r"^  (-\S+)(.*(?:\n {10,}.*)*)", told, re.MULTILINE)
    assert options and not [option for option, words in options if not re.search(r"(?:  |\n +)\w", words)]


def test_the_version_is_that_of_the_package_and_of_the_build(capsys: Captured) -> None:
    assert done("--version") == 0
    assert capsys.readouterr().out == f"quadvis {quadvis.__version__}\n"
    assert version("quadvis") == quadvis.__version__


COUNT = """
import cProfile, pstats, sys
profile = cProfile.Profile()
profile.enable()
from quadvis.cli import main
code = main(sys.argv[1:])
profile.disable()
heavy = {"cv2", "control", "scipy", "matplotlib", "mcap"} & {*sys.modules}
others = [name for name in sys.modules if not name.startswith("quadvis")]
print(code, len(others), pstats.Stats(profile).total_calls, *heavy)
"""


def test_check_starts_quickly(project: Path) -> None:
    found = subprocess.run(
        [sys.executable, "-c", COUNT, "check", str(DIAGRAMS / "hover.yaml"), "--variant", "geometric"],
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    code, modules, calls, *heavy = found.stdout.splitlines()[-1].split()
    assert (code, heavy) == ("0", [])
    assert int(modules) < 260  # beside our own; numpy and argparse bring most of them
    assert int(calls) < 500_000  # a quarter of a second of CPU; each command and kind of port adds some
