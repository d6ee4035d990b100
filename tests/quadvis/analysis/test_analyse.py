import json
import math
import shutil
import sys
from pathlib import Path

import control
import numpy as np
import pytest
from pytest import approx

import quadvis
from quadvis.analysis.probe import AnalysisError
from quadvis.analysis.questions import read_cuts, read_limits
from quadvis.cli import main
from quadvis.errors import QuadvisError

from .loops import DIAGRAMS, sampled

MARGINS = str(DIAGRAMS / "margins.yaml")


def told(capsys: pytest.CaptureFixture[str], *arguments: str) -> tuple[int, str, str]:
    """Exit code and what a command prints."""
    code = main(["analyse", *arguments])
    return code, *capsys.readouterr()


def test_the_tables_have_poles_margins_and_limits(capsys) -> None:
    code, out, _ = told(capsys, MARGINS)
    rows = {line.split("  ")[1].strip(): line.split() for line in out.splitlines() if line.startswith("  ")}
    assert code == 0 and out.splitlines()[0] == "margins: 8 states, continuous"
    assert rows["torque"][1:] == ["4.033", "rad/s", "68.6", "deg", "0.2968", "s", "x", "0.2,", "no", "upper"]
    assert rows["vision"][1:] == ["0.6891", "rad/s", "43.5", "deg", "1.103", "s", "no", "lower,", "x", "5"]
    assert "yaw misalignment  stable up to 43.55 deg" in out
    assert out.splitlines()[-1] == "STABLE"


def test_a_loop_that_is_not_stable_fails_and_says_what_grows(capsys) -> None:
    code, out, _ = told(capsys, MARGINS, "--set", "lag=0.6 s")
    assert code == 1
    assert out.splitlines()[-1].startswith("NOT STABLE: a disturbance grows by 0.0395 1/s, in ")


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


def test_bode_plots_are_written(capsys, tmp_path) -> None:
    _, out, _ = told(capsys, MARGINS, "-o", str(tmp_path / "new"))
    names = ["margins-bode-imu.png", "margins-bode-torque.png", "margins-bode-vision.png"]
    assert sorted(path.name for path in (tmp_path / "new").iterdir()) == names
    assert all((tmp_path / "new" / name).read_bytes().startswith(b"\x89PNG") for name in names)
    assert sorted(Path(line).name for line in out.splitlines()[-3:]) == names


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
    shutil.copytree(DIAGRAMS / "parts", tmp_path / "parts")
    shutil.copytree(DIAGRAMS / "calib", tmp_path / "calib")
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
