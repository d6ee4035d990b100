import json
import math
import re
import shutil
import sys
from io import StringIO
from pathlib import Path

import control
import numpy as np
import pytest
from pytest import approx

import quadvis
from quadvis.analysis.loops import AnalysisError
from quadvis.analysis.questions import read_cuts, read_limits
from quadvis.cli import main
from quadvis.errors import QuadvisError

from .loops import DIAGRAMS, limitless, sampled

MARGINS = str(DIAGRAMS / "margins.yaml")


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Exit code and what a command prints."""
    code = main(["analyse", *arguments])
    return code, *capsys.readouterr()


def test_the_tables_have_poles_margins_and_limits(capsys) -> None:
    code, out, _ = told(capsys, MARGINS)
    rows = {line.split("  ")[1].strip(): line.split() for line in out.splitlines() if line.startswith("  ")}
    assert code == 0 and out.splitlines()[0] == "margins: 8 states, continuous"
    torque = ["4.033", "rad/s", "68.6", "deg", "0.2968", "s", "x", "0.2,", "no", "upper"]
    vision = ["0.6891", "rad/s", "43.5", "deg", "1.103", "s", "no", "lower,", "x", "5"]
    assert (rows["torque"][1:-2], rows["vision"][1:-2]) == (torque, vision)
    assert all(float(peak) >= 1.0 for name in ("torque", "vision") for peak in rows[name][-2:])
    assert "yaw misalignment  stable up to 43.55 deg" in out
    assert out.splitlines()[-2:] == ["STABLE", "PASSED: 11 of 11 requirements on loops met"]


def test_a_loop_that_is_not_stable_fails_and_says_what_grows(capsys) -> None:
    code, out, _ = told(capsys, MARGINS, "--set", "lag=0.6 s")
    assert code == 1
    assert out.splitlines()[-2].startswith("NOT STABLE: a disturbance grows by 0.0395 1/s, in ")


@pytest.mark.slow
def test_the_json_has_all_of_it(capsys) -> None:
    facts = json.loads(told(capsys, MARGINS, "--json")[1])
    assert facts["stable"] is True and facts["hyperperiod_s"] == 0.0
    assert len(facts["poles"]) == len(facts["states"]) == 8
    torque = facts["cuts"]["torque"]
    assert torque["signals"] == ["roll.torque"]
    assert torque["gain_up"] is None and torque["gain_down"] == approx(0.2)
    assert math.degrees(torque["phase_lag"]) == approx(68.58, abs=0.01)
    assert facts["limits"]["motor lag"] == {
        "vary": "lag", "unit": "s", "stable_to": approx(0.5685, rel=1e-3), "reached": True, "reason": None,
    }  # fmt: skip


def test_cuts_and_limits_can_be_asked_for_on_the_command_line(capsys, tmp_path) -> None:
    path = str(sampled(tmp_path).path)
    arguments = ["--cut", "both=spring.y,damper.y", "--cut", "place.y", "--vary", "damping=1.5 1/s..100 1/s"]
    code, out, _ = told(capsys, path, *arguments)
    assert code == 0
    assert [line.split()[0] for line in out.splitlines() if "rad/s" in line and "deg" in line] == [
        "push", "both", "place.y",
    ]  # fmt: skip
    assert "damping  stable up to 40 1/s" in out


@pytest.fixture
def without_limits(tmp_path) -> str:
    """The same diagram without the search for limits."""
    path = tmp_path / "margins.yaml"
    path.write_text(limitless("margins.yaml"))
    return str(path)


@pytest.mark.slow
def test_bode_and_nyquist_plots_are_written(capsys, tmp_path, without_limits) -> None:
    _, out, _ = told(capsys, without_limits, "-o", str(tmp_path / "new"))
    kinds, cuts = ("bode", "nyquist"), ("imu", "torque", "vision")
    names = [f"margins-{kind}-{cut}.png" for kind in kinds for cut in cuts]
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == names
    assert all((tmp_path / "new" / name).read_bytes().startswith(b"\x89PNG") for name in names)
    assert sorted(Path(line).name for line in out.splitlines()[-6:]) == names


def test_pictures_are_refused_with_the_variant_that_has_none(capsys) -> None:
    code, _, error = told(capsys, str(DIAGRAMS / "hover.yaml"))
    assert code == 2
    assert error == (
        "block 'eyes/camera' gives pictures, and these cannot be linearised; "
        "the variant 'geometric' has none: --variant geometric\n"
    )


def test_pictures_without_such_a_variant_are_refused_with_a_block_that_would_do(tmp_path) -> None:
    shutil.copytree(DIAGRAMS / "recordings", tmp_path / "recordings")
    text = (DIAGRAMS / "hover.yaml").read_text().partition("variants:")[0]
    for folder in ("parts", "calib", "crafts"):
        shutil.copytree(DIAGRAMS / folder, tmp_path / folder)
    (tmp_path / "hover.yaml").write_text(text)
    with pytest.raises(
        AnalysisError, match=r"use a camera without pictures, such as vision\.geometric_camera"
    ):
        quadvis.load(tmp_path / "hover.yaml").analyse()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--cut", "roll.torq"], "--cut: block 'roll' has no output 'torq'; did you mean 'torque'?"),
        (
            ["--cut", "roll.level"],
            "--cut: 'roll.level' holds int64 values, which vary in no small steps; open the loop",
        ),
        (["--vary", "lag"], "--vary: 'lag' is not understood; write a parameter and its range"),
        (["--vary", "lag=0 s..1"], "--vary: 'to': '1' has no unit; did you mean '1 s'?"),
        (["--at", "5"], "--at: '5' has no unit; did you mean '5 s'?"),
    ],
)
def test_bad_questions_are_told_in_one_sentence(capsys, arguments, message) -> None:
    code, _, error = told(capsys, MARGINS, *arguments)
    assert code == 2 and error.startswith(message) and error.count("\n") == 1


def test_a_cut_beside_the_loop_is_refused(tmp_path) -> None:
    diagram = quadvis.load(DIAGRAMS / "hover.yaml", variant="geometric")
    with pytest.raises(
        AnalysisError, match=r"cut 'wind': 'gust\.wind' comes from a block that is on no loop"
    ):
        diagram.analyse(cuts={"wind": "gust.wind"})


def test_without_python_control_it_is_said_how_to_get_it(monkeypatch, tmp_path) -> None:
    analysis = sampled(tmp_path).analyse()
    monkeypatch.setitem(sys.modules, "control", None)
    with pytest.raises(QuadvisError, match=r"python-control is needed.*run 'pip install control'"):
        _ = analysis.system


def test_the_loops_are_objects_of_python_control(tmp_path) -> None:
    system = sampled(tmp_path).analyse().loops["push"].system
    assert isinstance(system, control.StateSpace)
    assert control.feedback(system, 1).poles() == approx(
        np.linalg.eigvals(sampled(tmp_path).analyse().linear.a), abs=1e-7
    )
    assert system.input_labels == ["push:y @ 0 us in"] and system.output_labels == ["push:y @ 0 us out"]


def test_signals_are_split_at_the_commas_outside_of_an_index() -> None:
    assert read_cuts(["a.y[0,1],b.y", "two=c.y, d.y[2]"]) == {
        "a.y[0,1],b.y": ["a.y[0,1]", "b.y"],
        "two": ["c.y", "d.y[2]"],
    }
    assert read_limits(["target[3]=0 deg..90 deg"]) == {"target[3]": ("target[3]", "0 deg", "90 deg")}


# Diagrams without a loop.

HEAD = "quadvis: 1\nname: open\nrates: {fast: 10 Hz}\nstop_time: 2 s\nblocks:\n"
SOURCE = "  source: {block: sources.constant, rate: fast, with: {value: 1}}\n"
SINE = "  source: {block: sources.sine, rate: fast}\n"
NOISE = "  source: {block: sources.noise, rate: fast}\n"
GAIN = "  gain: {block: signal.gain, rate: fast, in: {u: source.y}}\n"
LAG = "  lag: {block: signal.low_pass, rate: fast, with: {time_constant: 0.2 s}, in: {u: source.y}}\n"
SUM = "  sum: {block: signal.discrete_integrator, rate: fast, in: {u: source.y}}\n"
FLOW = "  flow: {block: signal.integrator, rate: continuous, in: {u: {from: source.y, across: hold}}}\n"
SOLVER = "solver: {method: ode4, step: 10 ms}\n"


@pytest.mark.parametrize("blocks", [SOURCE, SINE, NOISE, SOURCE + GAIN, SINE + GAIN, NOISE + GAIN])
@pytest.mark.parametrize("more", [[], ["--json"]])
def test_nothing_to_analyse_is_a_sentence(blocks, more, tmp_path, capsys) -> None:
    (tmp_path / "open.yaml").write_text(HEAD + blocks)
    code, out, error = told(capsys, str(tmp_path / "open.yaml"), *more)
    assert (code, out) == (2, "")
    assert error == "there is nothing to analyse: the diagram has no loop and no state\n"


@pytest.mark.parametrize(
    ("blocks", "cut"),
    [
        (SOURCE, "source.y"), (SINE, "source.y"), (SOURCE + GAIN, "gain.y"), (SOURCE + LAG, "source.y"),
        (SOURCE + LAG, "lag.y"), (SOURCE + SUM, "source.y"), (SOURCE + SUM, "sum.y"), (NOISE + SUM, "sum.y"),
        (SOURCE + FLOW, "flow.y"), (SOURCE + GAIN + LAG + SUM, "gain.y"),
    ],
)  # fmt: skip
def test_a_cut_where_there_is_no_loop_is_the_sentence_of_one_beside_a_loop(
    blocks, cut, tmp_path, capsys
) -> None:
    head = HEAD.replace("stop_time", SOLVER + "stop_time") if "continuous" in blocks else HEAD
    (tmp_path / "open.yaml").write_text(f"{head}{blocks}analyse: {{cuts: {{here: {cut}}}}}\n")
    code, out, error = told(capsys, str(tmp_path / "open.yaml"))
    assert (code, out) == (2, "")
    assert error == f"cut 'here': '{cut}' comes from a block that is on no loop; the diagram has none\n"


CAMERA = '''
"""A camera of the test."""

from quadvis.block import Block, In, Out


class Camera(Block, numeric=False):
    """Gives no frames."""

    position = In(unit="a")
    frame = Out("frame")
    seen = Out(unit="a")

    def output(self, position):
        """Return nothing new."""
        from quadvis.block import NO_FRAME

        return NO_FRAME, position


class Reader(Block, numeric=False):
    """Reads frames."""

    frame = In("frame")
    count = Out()

    def output(self, frame):
        """Return their number."""
        return float(frame.sequence)
'''
WATCHED = """
  camera: {block: own.camera, rate: fast, in: {position: {from: place.y, across: sample}}}
"""


def watched_loop(tmp_path: Path, more: str = "") -> str:
    """Return a loop with a camera beside it."""
    sampled(tmp_path)
    (tmp_path / "blocks" / "own").mkdir(parents=True)
    source, _, reader = CAMERA.partition("\n\nclass Reader")
    (tmp_path / "blocks" / "own" / "camera.py").write_text(source)
    head = source.partition("class Camera")[0]
    (tmp_path / "blocks" / "own" / "reader.py").write_text(f"{head}class Reader{reader}")
    path = tmp_path / "loop.yaml"
    path.write_text(path.read_text().replace("analyse:", f"{WATCHED}{more}analyse:"))
    return str(path)


def test_a_camera_whose_pictures_nobody_reads_is_no_obstacle(tmp_path, capsys) -> None:
    code, out, error = told(capsys, watched_loop(tmp_path))
    assert (code, error.count("\n")) == (0, 1)
    assert error.startswith("own blocks from ")
    assert out.splitlines()[-1] == "STABLE"


def test_pictures_that_are_read_are_refused(tmp_path, capsys) -> None:
    reader = "  reader: {block: own.reader, rate: fast, in: {frame: camera.frame}}\n"
    code, _, error = told(capsys, watched_loop(tmp_path, reader))
    assert code == 2
    problem = error.splitlines()[1]  # the first line says whose blocks they are
    assert problem.startswith("block 'camera' gives pictures, and these cannot be linearised; use a camera")


# What is shown meanwhile.


class Terminal(StringIO):
    """A terminal that keeps what it shows."""

    def isatty(self) -> bool:
        return True


@pytest.mark.slow
def test_what_takes_long_shows_which_limit_is_sought_and_how_far_it_is(monkeypatch, capsys) -> None:
    terminal = Terminal()
    monkeypatch.setattr("quadvis.machine.status_line.PATIENCE", 0.0)
    monkeypatch.setattr("quadvis.machine.status_line.RENEWED", 0.0)
    monkeypatch.setattr(sys, "stderr", terminal)
    assert main(["analyse", MARGINS, "--vary", "lag=50 ms..1 s"]) == 0
    out = capsys.readouterr().out
    shown = terminal.getvalue()
    assert "running to the operating point" in shown
    assert re.search(
        r"limit 'motor lag': at [\d.]+ s, from [\d.]+ s to [\d.]+ s: \d+ states disturbed", shown
    )
    assert "limit 'lag': at 50 ms, from 50 ms to" in shown or "limit 'lag': at 0.05" in shown
    assert shown.endswith("\r\x1b[K")
    assert "\x1b" not in out and out.splitlines()[-1] == "PASSED: 11 of 11 requirements on loops met"


def test_nothing_is_shown_of_what_is_quick_or_where_nobody_watches(
    monkeypatch, capsys, without_limits
) -> None:
    terminal = Terminal()
    monkeypatch.setattr("quadvis.machine.status_line.PATIENCE", 1e9)
    with monkeypatch.context() as patched:
        patched.setattr(sys, "stderr", terminal)
        main(["analyse", without_limits])
    assert not terminal.getvalue().replace("\r\x1b[K", "")
    monkeypatch.setattr("quadvis.machine.status_line.PATIENCE", 0.0)
    assert told(capsys, without_limits)[2] == ""


@pytest.mark.parametrize("step", ["running to", "0 states", "3 states", "limit 'motor lag'", "limit 'yaw"])
def test_an_interrupted_analysis_ends_with_a_word(step, monkeypatch, capsys) -> None:
    def interrupt(self, text: str) -> None:
        if step in text:
            raise KeyboardInterrupt

    monkeypatch.setattr("quadvis.machine.status_line.AnalysisLine.__call__", interrupt)
    code, _, error = told(capsys, MARGINS)
    assert (code, error) == (130, "interrupted\n")


@pytest.mark.slow
def test_a_remark_does_not_look_like_a_row_of_a_table(tmp_path, capsys) -> None:
    path = sampled(tmp_path).path
    path.write_text(path.read_text().partition("analyse:")[0])
    out = told(capsys, str(path))[1].splitlines()
    assert "No loop was opened: name signals with --cut, or under 'analyse: {cuts: ...}'." in out
    many = told(capsys, str(DIAGRAMS / "margins.yaml"))[1].splitlines()
    assert all(len(re.split(r"\s{2,}", line.strip())) > 1 for line in many[1:-1] if line.startswith("  "))
